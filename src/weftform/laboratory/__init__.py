"""From measured curves to laws."""
