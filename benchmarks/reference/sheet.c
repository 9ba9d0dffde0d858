/* The yardstick: the time loop of weftform for a full square blank, by hand.

   Same physics as src/weftform/solver, same formulas as src/weftform/mechanics: connectors with dashpots, membrane in
   total form, hourglass control, three rigid tools with penalty and Coulomb friction, mass damping, central differences,
   heats of friction and damping for the energy ledger, the survey that finds the rows each tool can touch.

   What it may do and the package may not: every cell is whole and every crossing is there, so cell volume and line weights are
   numbers and mass and area are one row for all; a piece of a row meets all its tools in one loop, which also moves it,
   compiled for each way in which they can stand to it.

   Sizes and degrees are macros: STRIDE, TOOLS (0 or 3), WARP_DEGREE, WEFT_DEGREE, SHEAR_DEGREE, SERIES, and RESTRICT
   (1: a tool is evaluated on pieces of rows that it can touch; 0: everywhere). */

#include <immintrin.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define ROW ((size_t)6 * STRIDE)
#define LEAD 8
#define LANES 8
#define INLINE static inline __attribute__((always_inline))

enum { CLEAR, TOUCHING, ON_FACE };
enum { SIDE_S, S0, SIDE_Z, Z0, RADIUS, HALF, STIFFNESS, FRICTION, RATIO, MOTION, MASS, RATE, TOOL_COLUMNS };
enum { AT, SPEED, REACTION, LAST_AT, LAST_DRIVE, WORK, DAMPED, POSE_COLUMNS };
enum { FASTEST, WARP_SQUARED, WEFT_SQUARED, LEAST_SQUARED, TANGENT, PENETRATION, FINITE, MOVING, SURVEYED };

typedef struct {
    int64_t rows, columns;
    double *state;               /* [rows][6][STRIDE]: x y z, vx vy vz */
    double *grip;                /* [rows][TOOLS][3][STRIDE]: friction traction of each tool */
    const double *inverse_mass;  /* [2][STRIDE]: first and last row, rows between; the same for those below */
    const double *inertia;       /* area whose mass a crossing carries */
    const double *area;          /* area in contact */
    const double *warp_line, *weft_line; /* [STRIDE]: 1 where a line starts at the column */
    const double *warp, *weft, *shear, *series; /* coefficients, highest power first */
    double warp_end[3], weft_end[3], shear_end[2]; /* width, slope beyond, slope in compression */
    double warp_pitch, weft_pitch, warp_modulus, weft_modulus, hourglass, volume;
    double density, damping, viscous; /* viscous: viscosity times cell area */
    double *tools;               /* [TOOLS][TOOL_COLUMNS] */
    double *poses;               /* [TOOLS][POSE_COLUMNS] */
    int8_t *touching;            /* [rows][blocks of LANES columns]: how the block stands to the tools, digits to base 3 */
    const double *times, *values; /* motions: [motions][knots] */
    const int64_t *knots;
    int64_t most_knots;
    double ramp, end_ramp, time, step, last_step;
    double inertia_factor;       /* variable mass scaling: on all masses of the fabric */
    double damped;               /* heat of damping so far */
    double slipped[3];           /* heat of friction of each tool so far */
} Sheet;

INLINE double least(double a, double b) { return a < b ? a : b; }
INLINE double most(double a, double b) { return a > b ? a : b; }

INLINE double horner(const double *c, int degree, double x)
{
    double squared = x * x, v = c[0], w = c[1];
#pragma GCC unroll 32
    for (int k = 2; k < degree; k += 2) {
        v = v * squared + c[k];
        w = w * squared + c[k + 1];
    }
    return degree > 1 && degree % 2 == 0 ? v * squared + (w * x + c[degree]) : v * x + w;
}

INLINE double law(const double *c, int degree, const double *end, double x)
{
    return horner(c, degree, least(x, end[0])) + end[1] * most(x - end[0], 0.0);
}

/* 1 / sqrt(a), a > 0: a guess from the exponent and two steps of fourth and third order, good to the last digit but one.
   A division and a root occupy the divider for 40 clocks per vector; this takes 7 of the multipliers, which run beside it. */
INLINE double inverse_root(double a)
{
    int64_t bits;
    double y;
    memcpy(&bits, &a, 8);
    bits = 0x5FE6EB50C7B537A9 - (bits >> 1);
    memcpy(&y, &bits, 8);
    double r = 1.0 - a * y * y;
    y += y * r * (0.5 + r * (0.375 + r * 0.3125));
    r = 1.0 - a * y * y;
    return y + y * r * (0.5 + r * 0.375);
}

/* scratch of the sweep: it never leaves the first-level cache */
static double warp_force[3][LEAD + STRIDE] __attribute__((aligned(64)));
static double half_weft[3][LEAD + STRIDE] __attribute__((aligned(64)));
static double weft_force[3][LEAD + STRIDE] __attribute__((aligned(64)));
static double upper[3][LEAD + STRIDE] __attribute__((aligned(64)));
static double below[3][LEAD + STRIDE] __attribute__((aligned(64)));

/* Pull of a connector along (dx, dy, dz), per length, and the heat of its dashpot, which acts on the initial length. */
INLINE double connector(double squared, double inverse, double dx, double dy, double dz, double ux, double uy, double uz,
                        const double *c, int degree, const double *end, double inverse_length, double viscosity, double weight,
                        double *heat)
{
    double strain = squared * inverse * inverse_length - 1.0;
    double pull = law(c, degree, end, most(strain, 0.0)) + end[2] * least(strain, 0.0);
    double rate = dx * ux + dy * uy + dz * uz, drag = viscosity * rate;
    *heat += weight * drag * rate;
    return weight * (pull * inverse + drag);
}

/* Warp connectors of a row, and the cells and weft connectors above it. Returns the heat of the dashpots. */
INLINE double edges(const Sheet *q, const double *restrict row, double viscosity)
{
    double cw[WARP_DEGREE + 1], cf[WEFT_DEGREE + 1], cs[SHEAR_DEGREE + 1], cl[SERIES];
    double ew[3], ef[3], es[2];
    memcpy(cw, q->warp, sizeof cw);
    memcpy(cf, q->weft, sizeof cf);
    memcpy(cs, q->shear, sizeof cs);
    memcpy(cl, q->series, sizeof cl);
    memcpy(ew, q->warp_end, sizeof ew);
    memcpy(ef, q->weft_end, sizeof ef);
    memcpy(es, q->shear_end, sizeof es);
    const double *restrict x = row, *restrict y = row + STRIDE, *restrict z = row + 2 * STRIDE;
    const double *restrict vx = row + 3 * STRIDE, *restrict vy = row + 4 * STRIDE, *restrict vz = row + 5 * STRIDE;
    const double *restrict xu = x + ROW, *restrict yu = y + ROW, *restrict zu = z + ROW;
    const double *restrict vxu = vx + ROW, *restrict vyu = vy + ROW, *restrict vzu = vz + ROW;
    const double *restrict warp_line = q->warp_line, *restrict weft_line = q->weft_line;
    const double i1 = 1.0 / q->warp_pitch, i2 = 1.0 / q->weft_pitch, e1 = q->warp_modulus, e2 = q->weft_modulus;
    const double volume = 0.5 * q->volume, stabilise = q->hourglass * q->volume;
    const double h1 = 0.5 * i1, h2 = 0.5 * i2, c1 = viscosity * i1 * i1, c2 = viscosity * i2 * i2;
    double *restrict w0 = warp_force[0] + LEAD, *restrict w1 = warp_force[1] + LEAD, *restrict w2 = warp_force[2] + LEAD;
    double *restrict q0 = half_weft[0] + LEAD, *restrict q1 = half_weft[1] + LEAD, *restrict q2 = half_weft[2] + LEAD;
    double *restrict f0 = weft_force[0] + LEAD, *restrict f1 = weft_force[1] + LEAD, *restrict f2 = weft_force[2] + LEAD;
    double *restrict t0 = upper[0] + LEAD, *restrict t1 = upper[1] + LEAD, *restrict t2 = upper[2] + LEAD;
    const int64_t n = (q->columns + 7) & ~7;
    double heat = 0.0;
#pragma omp simd reduction(+ : heat)
    for (int64_t i = 0; i < n; i++) {
        /* all roots first: the three chains of one vector wait for them together */
        double lx = x[i + 1] - x[i], ly = y[i + 1] - y[i], lz = z[i + 1] - z[i];
        double ax = xu[i] - x[i], ay = yu[i] - y[i], az = zu[i] - z[i];
        /* twist of the cell: its upper edge less its lower edge, which is also its right edge less its left edge */
        double hx = xu[i + 1] - xu[i] - lx, hy = yu[i + 1] - yu[i] - ly, hz = zu[i + 1] - zu[i] - lz;
        double warp2 = lx * lx + ly * ly + lz * lz, weft2 = ax * ax + ay * ay + az * az;
        double g1x = h1 * (lx + lx + hx), g1y = h1 * (ly + ly + hy), g1z = h1 * (lz + lz + hz);
        double g2x = h2 * (ax + ax + hx), g2y = h2 * (ay + ay + hy), g2z = h2 * (az + az + hz);
        double g11 = g1x * g1x + g1y * g1y + g1z * g1z;
        double g22 = g2x * g2x + g2y * g2y + g2z * g2z;
        double g12 = g1x * g2x + g1y * g2y + g1z * g2z;
        double product = g11 * g22, area2 = most(product - g12 * g12, 1.0e-6);
        double area = area2 * inverse_root(area2), diagonal = product * inverse_root(product) + area;
        double warp_root = inverse_root(warp2), weft_root = inverse_root(weft2);
        double p1 = g11 + 1.0, p2 = g22 + 1.0, pp = p1 * p2, by = product * pp;
        double inverse = 1.0 / (by * diagonal);
        double line = warp_line[i], hot = 0.0;
        double f = connector(warp2, warp_root, lx, ly, lz, vx[i + 1] - vx[i], vy[i + 1] - vy[i], vz[i + 1] - vz[i], cw,
                             WARP_DEGREE, ew, i1, c1, line, &hot);
        double w = connector(weft2, weft_root, ax, ay, az, vxu[i] - vx[i], vyu[i] - vy[i], vzu[i] - vz[i], cf, WEFT_DEGREE,
                             ef, i2, c2, weft_line[i], &hot);
        double px = f * lx + t0[i], py = f * ly + t1[i], pz = f * lz + t2[i];
        double t = g12 * (inverse * by);
        double d = inverse * diagonal, by_pp = d * product, by_product = d * pp;
        double y1 = (g11 - 1.0) * (p2 * by_pp), y2 = (g22 - 1.0) * (p1 * by_pp);
        double s1 = e1 * y1 * horner(cl, SERIES - 1, y1 * y1);
        double s2 = e2 * y2 * horner(cl, SERIES - 1, y2 * y2);
        double tau = t * law(cs, SHEAR_DEGREE, es, fabs(t));
        double v = volume * line, k = stabilise * line;
        double a12 = v * tau, twist = g12 * tau;
        double a11 = (v * i1) * (area * s1 - twist) * (by_product * g22), b12 = i1 * a12;
        double a22 = (v * i2) * (area * s2 - twist) * (by_product * g11), c12 = i2 * a12;
        double mx = a11 * g1x + b12 * g2x, my = a11 * g1y + b12 * g2y, mz = a11 * g1z + b12 * g2z;
        double nx = a22 * g2x + c12 * g1x, ny = a22 * g2y + c12 * g1y, nz = a22 * g2z + c12 * g1z;
        px += mx - k * hx, py += my - k * hy, pz += mz - k * hz;
        t0[i] = mx + k * hx, t1[i] = my + k * hy, t2[i] = mz + k * hz;
        q0[i] = nx, q1[i] = ny, q2[i] = nz;
        f0[i] = w * ax + nx, f1[i] = w * ay + ny, f2[i] = w * az + nz;
        w0[i] = px, w1[i] = py, w2[i] = pz;
        heat += hot;
    }
    return heat;
}

/* Warp connectors of the last row, which has no cells above it. */
static double last_edges(const Sheet *q, const double *restrict row, double viscosity)
{
    const double *restrict x = row, *restrict y = row + STRIDE, *restrict z = row + 2 * STRIDE;
    const double *restrict vx = row + 3 * STRIDE, *restrict vy = row + 4 * STRIDE, *restrict vz = row + 5 * STRIDE;
    double heat = 0.0;
    for (int64_t i = 0; i < q->columns; i++) {
        double dx = x[i + 1] - x[i], dy = y[i + 1] - y[i], dz = z[i + 1] - z[i], squared = dx * dx + dy * dy + dz * dz;
        double f = connector(squared, inverse_root(squared), dx, dy, dz, vx[i + 1] - vx[i], vy[i + 1] - vy[i],
                             vz[i + 1] - vz[i], q->warp, WARP_DEGREE, q->warp_end, 1.0 / q->warp_pitch,
                             viscosity / (q->warp_pitch * q->warp_pitch), q->warp_line[i], &heat);
        warp_force[0][LEAD + i] = f * dx + upper[0][LEAD + i];
        warp_force[1][LEAD + i] = f * dy + upper[1][LEAD + i];
        warp_force[2][LEAD + i] = f * dz + upper[2][LEAD + i];
    }
    memset(half_weft, 0, sizeof half_weft);
    memset(weft_force, 0, sizeof weft_force);
    return heat;
}

typedef struct {
    double side_s, s0, side_z, z0, radius, half, stiffness, friction, ratio, z, moved;
} Pose;

/* Contact of a crossing with a tool: adds its force, keeps the friction traction, returns the axial force. */
INLINE double touch(const Pose p, int how, double x, double y, double z, double wayx, double wayy, double wayz, double away,
                    double by_away, double area, double *tx, double *ty, double *tz, double *fx, double *fy, double *fz,
                    double *heat)
{
    double kt = p.ratio * p.stiffness, distance, nx, ny, nz;
    if (how == ON_FACE) {
        distance = p.side_z * (z - p.z - p.z0) - p.radius;
        nx = ny = 0.0;
        nz = p.side_z;
    } else {
        double u = p.side_s * (away - p.s0), w = p.side_z * (z - p.z - p.z0);
        double ou = most(u, 0.0), ow = most(w, 0.0);
        double squared = ou * ou + ow * ow;
        double inverse = inverse_root(most(squared, 1.0e-300));
        distance = squared * inverse + least(most(u, w), 0.0) - p.radius;
        double inside = squared < 1.0e-300 ? 1.0 : 0.0, flat = w >= u ? inside : 0.0;
        double radial = p.side_s * (ou * inverse + (inside - flat)) * by_away;
        nx = x * radial;
        ny = y * radial;
        nz = p.side_z * (ow * inverse + flat);
    }
    double press = p.stiffness * most(p.half - distance, 0.0);
    double wx = *tx - kt * wayx, wy = *ty - kt * wayy, wz = 0.0;
    if (how != ON_FACE) {
        wz = *tz - kt * (wayz - p.moved);
        double along = wx * nx + wy * ny + wz * nz;
        wx -= along * nx;
        wy -= along * ny;
        wz -= along * nz;
    }
    double squared = wx * wx + wy * wy + wz * wz;
    double inverse = inverse_root(most(squared, 1.0e-300));
    double share = least(1.0, p.friction * press * inverse);
    double size = squared * inverse, kept = share * size;
    *heat += area * ((size - kept) * kept);
    *tx = wx = share * wx;
    *ty = wy = share * wy;
    if (how != ON_FACE) *tz = wz = share * wz;
    double axial = area * (press * nz + wz);
    *fx += area * (press * nx + wx);
    *fy += area * (press * ny + wy);
    *fz += axial;
    return axial;
}

/* Sum of the forces on a piece of a row, contact with each tool as it stands to it, and central differences. */
INLINE void crossings(Sheet *q, double *restrict row, int64_t j, int64_t begin, int64_t end, const int *how, double step,
                      double last_step, double kick, double keep, double damping, double *reactions)
{
    const int profile = j > 0 && j < q->rows - 1;
    const double *restrict inverse_mass = q->inverse_mass + profile * STRIDE;
    const double *restrict inertia = q->inertia + profile * STRIDE;
    const double *restrict area = q->area + profile * STRIDE;
    double *restrict x = row, *restrict y = row + STRIDE, *restrict z = row + 2 * STRIDE;
    double *restrict vx = row + 3 * STRIDE, *restrict vy = row + 4 * STRIDE, *restrict vz = row + 5 * STRIDE;
    const double *restrict w0 = warp_force[0] + LEAD, *restrict w1 = warp_force[1] + LEAD, *restrict w2 = warp_force[2] + LEAD;
    const double *restrict q0 = half_weft[0] + LEAD, *restrict q1 = half_weft[1] + LEAD, *restrict q2 = half_weft[2] + LEAD;
    const double *restrict f0 = weft_force[0] + LEAD, *restrict f1 = weft_force[1] + LEAD, *restrict f2 = weft_force[2] + LEAD;
    double *restrict b0 = below[0] + LEAD, *restrict b1 = below[1] + LEAD, *restrict b2 = below[2] + LEAD;
    double damped = 0.0;
#if TOOLS
    Pose pose[3];
    for (int k = 0; k < 3; k++) {
        const double *t = q->tools + k * TOOL_COLUMNS, *p = q->poses + k * POSE_COLUMNS;
        pose[k] = (Pose){t[SIDE_S], t[S0], t[SIDE_Z], t[Z0], t[RADIUS], t[HALF], t[STIFFNESS], t[FRICTION], t[RATIO],
                         p[AT], p[AT] - p[LAST_AT]};
    }
    double *restrict t0 = q->grip + j * (9 * STRIDE), *restrict t1 = t0 + 3 * STRIDE, *restrict t2 = t1 + 3 * STRIDE;
    double r0 = 0.0, r1 = 0.0, r2 = 0.0, s0 = 0.0, s1 = 0.0, s2 = 0.0;
    const int curved = how[0] == TOUCHING || how[1] == TOUCHING || how[2] == TOUCHING;
#pragma omp simd reduction(+ : damped, r0, r1, r2, s0, s1, s2)
#else
#pragma omp simd reduction(+ : damped)
#endif
    for (int64_t i = begin; i < end; i++) {
        double ux = f0[i] + q0[i - 1], uy = f1[i] + q1[i - 1], uz = f2[i] + q2[i - 1];
        double fx = w0[i] - w0[i - 1] + ux - b0[i], fy = w1[i] - w1[i - 1] + uy - b1[i], fz = w2[i] - w2[i - 1] + uz - b2[i];
        b0[i] = ux, b1[i] = uy, b2[i] = uz;
        double ox = vx[i], oy = vy[i], oz = vz[i], px = x[i], py = y[i], pz = z[i];
#if TOOLS
        double wayx = ox * last_step, wayy = oy * last_step, wayz = oz * last_step, away = 0.0, by_away = 0.0;
        if (curved) {
            double squared = px * px + py * py;
            by_away = inverse_root(most(squared, 1.0e-24));
            away = squared * by_away;
        }
#define TOUCH(k, t, r, s)                                                                                                  \
        if (how[k])                                                                                                        \
            r += touch(pose[k], how[k], px, py, pz, wayx, wayy, wayz, away, by_away, area[i], t + i,                        \
                       t + STRIDE + i, t + 2 * STRIDE + i, &fx, &fy, &fz, &s);
        TOUCH(0, t0, r0, s0)
        TOUCH(1, t1, r1, s1)
        TOUCH(2, t2, r2, s2)
#endif
        double m = kick * inverse_mass[i];
        double nx = keep * ox + m * fx, ny = keep * oy + m * fy, nz = keep * oz + m * fz;
        vx[i] = nx, vy[i] = ny, vz[i] = nz;
        x[i] = px + step * nx, y[i] = py + step * ny, z[i] = pz + step * nz;
        double dx = ox + nx, dy = oy + ny, dz = oz + nz;
        damped += inertia[i] * (dx * dx + dy * dy + dz * dz);
    }
    q->damped += damping * damped;
#if TOOLS
    reactions[0] += r0, reactions[1] += r1, reactions[2] += r2;
    q->slipped[0] += s0, q->slipped[1] += s1, q->slipped[2] += s2;
#endif
}

static double progress(double at, double ramp, double end_ramp)
{
    double peak = 1.0 / (1.0 - 0.5 * (ramp + end_ramp));
    if (at <= 0.0) return 0.0;
    if (at >= 1.0) return 1.0;
    double length = at < ramp ? ramp : end_ramp;
    double x = (at < ramp ? at : 1.0 - at) / length, part = peak * length * x * x * x * (1.0 - 0.5 * x);
    if (at < ramp) return part;
    if (at > 1.0 - end_ramp) return 1.0 - part;
    return peak * (at - 0.5 * ramp);
}

static double motion(const Sheet *q, int64_t k, double time)
{
    const double *t = q->times + k * q->most_knots, *v = q->values + k * q->most_knots;
    if (time <= t[0]) return v[0];
    for (int64_t i = 0; i + 1 < q->knots[k]; i++)
        if (time < t[i + 1]) {
            double share = (time - t[i]) / (t[i + 1] - t[i]);
            return v[i] + (v[i + 1] - v[i]) * progress(share, q->ramp, q->end_ramp);
        }
    return v[q->knots[k] - 1];
}

static void move_tools(Sheet *q, const double *reactions, double mean_step)
{
    for (int k = 0; k < TOOLS; k++) {
        double *t = q->tools + k * TOOL_COLUMNS, *p = q->poses + k * POSE_COLUMNS;
        double z = p[AT], travelled = z - p[LAST_AT], drive = reactions[k], ahead = z;
        p[REACTION] = reactions[k];
        if (t[MASS] > 0.0) {
            drive = motion(q, (int64_t)t[MOTION], q->time);
            double half = 0.5 * t[RATE] * mean_step, old = p[SPEED];
            double now = (old * (1.0 - half) + mean_step * (drive - reactions[k]) / t[MASS]) / (1.0 + half);
            p[DAMPED] += 0.25 * t[RATE] * t[MASS] * (old + now) * (old + now) * mean_step;
            p[SPEED] = now;
            ahead = z + q->step * now;
        } else if (t[MOTION] >= 0.0) {
            ahead = motion(q, (int64_t)t[MOTION], q->time + q->step);
        }
        p[WORK] += 0.5 * (drive + p[LAST_DRIVE]) * travelled;
        p[LAST_DRIVE] = drive;
        p[LAST_AT] = z;
        p[AT] = ahead;
    }
}

/* Make steps of equal length. */
void advance(Sheet *q, int64_t steps)
{
    unsigned mode = _mm_getcsr();
    _mm_setcsr(mode | 0x8040); /* flush to zero: a sheet at rest ahead of the wave front makes subnormal numbers */
    for (int64_t done = 0; done < steps; done++) {
        double mean_step = 0.5 * (q->step + q->last_step), half = 0.5 * q->damping * mean_step;
        double keep = (1.0 - half) / (1.0 + half), kick = mean_step / ((1.0 + half) * q->inertia_factor);
        double density = q->density * q->inertia_factor;
        double damping = 0.25 * q->damping * density * mean_step, viscosity = q->viscous * density / q->step;
        double reactions[3] = {0.0, 0.0, 0.0}, heat = 0.0;
        const int64_t n = (q->columns + 7) & ~7;
        memset(below, 0, sizeof below);
        memset(upper, 0, sizeof upper);
        for (int64_t j = 0; j < q->rows; j++) {
            double *row = q->state + j * ROW;
            heat += j + 1 < q->rows ? edges(q, row, viscosity) : last_edges(q, row, viscosity);
#if !TOOLS
            crossings(q, row, j, 0, n, 0, q->step, q->last_step, kick, keep, damping, reactions);
#elif !RESTRICT
            crossings(q, row, j, 0, n, (const int[]){1, 1, 1}, q->step, q->last_step, kick, keep, damping, reactions);
#else
            const int8_t *how = q->touching + j * (n / LANES);
            for (int64_t begin = 0, end; begin < n; begin = end) {
                const int8_t code = how[begin / LANES];
                for (end = begin + LANES; end < n && how[end / LANES] == code;) end += LANES;
#define NODES(a, b, c)                                                                                                     \
    case 9 * a + 3 * b + c:                                                                                                \
        crossings(q, row, j, begin, end, (const int[]){a, b, c}, q->step, q->last_step, kick, keep, damping, reactions);   \
        break;
#define NODES3(a, b) NODES(a, b, 0) NODES(a, b, 1) NODES(a, b, 2)
#define NODES9(a) NODES3(a, 0) NODES3(a, 1) NODES3(a, 2)
                switch (code) {
                    NODES9(0) NODES9(1)
                default: /* the flat face of a punch: a hemisphere has none, and TOUCHING holds for it too */
                    crossings(q, row, j, begin, end, (const int[]){1, 1, 1}, q->step, q->last_step, kick, keep, damping,
                              reactions);
                }
            }
#endif
        }
        q->damped += q->step * heat;
        move_tools(q, reactions, mean_step);
        q->time += q->step;
        q->last_step = q->step;
    }
    _mm_setcsr(mode);
}

/* A look at the whole state: extremes for the stable step, and how each block of a row stands to each tool. */
void survey(Sheet *q, double *found, int64_t ahead, double margin)
{
    double fastest = 0.0, warp = 0.0, weft = 0.0, shortest = 1.0e300, tangent = 0.0, deepest = 0.0, sum = 0.0, moving = 0.0;
    const int64_t columns = q->columns, blocks = (columns + 7) / LANES;
    for (int64_t j = 0; j < q->rows; j++) {
        const double *restrict x = q->state + j * ROW, *restrict y = x + STRIDE, *restrict z = x + 2 * STRIDE;
        const double *restrict vx = x + 3 * STRIDE, *restrict vy = x + 4 * STRIDE, *restrict vz = x + 5 * STRIDE;
        const double *restrict inertia = q->inertia + (j > 0 && j < q->rows - 1) * STRIDE;
#pragma omp simd reduction(max : fastest) reduction(+ : sum, moving)
        for (int64_t i = 0; i < columns; i++) {
            double speed = vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i];
            fastest = most(fastest, speed);
            moving += inertia[i] * speed;
            sum += x[i] + y[i] + z[i] + speed;
        }
#pragma omp simd reduction(max : warp) reduction(min : shortest)
        for (int64_t i = 0; i < columns - 1; i++) {
            double dx = x[i + 1] - x[i], dy = y[i + 1] - y[i], dz = z[i + 1] - z[i], squared = dx * dx + dy * dy + dz * dz;
            warp = most(warp, squared);
            shortest = least(shortest, squared);
        }
        if (j + 1 == q->rows) continue;
        const double *restrict xu = x + ROW, *restrict yu = y + ROW, *restrict zu = z + ROW;
        const double i1 = 0.5 / q->warp_pitch, i2 = 0.5 / q->weft_pitch;
#pragma omp simd reduction(max : weft) reduction(min : shortest)
        for (int64_t i = 0; i < columns; i++) {
            double dx = xu[i] - x[i], dy = yu[i] - y[i], dz = zu[i] - z[i], squared = dx * dx + dy * dy + dz * dz;
            weft = most(weft, squared);
            shortest = least(shortest, squared);
        }
#pragma omp simd reduction(max : tangent)
        for (int64_t i = 0; i < columns - 1; i++) {
            double lx = x[i + 1] - x[i], ly = y[i + 1] - y[i], lz = z[i + 1] - z[i];
            double ax = xu[i] - x[i], ay = yu[i] - y[i], az = zu[i] - z[i];
            double ux = xu[i + 1] - xu[i], uy = yu[i + 1] - yu[i], uz = zu[i + 1] - zu[i];
            double g1x = i1 * (lx + ux), g1y = i1 * (ly + uy), g1z = i1 * (lz + uz);
            double g2x = i2 * (2.0 * ax + ux - lx), g2y = i2 * (2.0 * ay + uy - ly), g2z = i2 * (2.0 * az + uz - lz);
            double g11 = g1x * g1x + g1y * g1y + g1z * g1z, g22 = g2x * g2x + g2y * g2y + g2z * g2z;
            double g12 = g1x * g2x + g1y * g2y + g1z * g2z;
            double t = fabs(g12) / (sqrt(g11 * g22) + sqrt(most(g11 * g22 - g12 * g12, 1.0e-6)));
            tangent = most(tangent, t);
        }
    }
    fastest = sqrt(fastest);
    if (TOOLS) memset(q->touching, 0, q->rows * blocks);
    for (int k = 0, digit = 9; k < TOOLS; k++, digit /= 3) {
        const double *t = q->tools + k * TOOL_COLUMNS, *p = q->poses + k * POSE_COLUMNS;
        const double side_s = t[SIDE_S], s0 = t[S0], side_z = t[SIDE_Z], z0 = t[Z0] + p[AT], off = t[RADIUS] + t[HALF];
        const double way = 2.0 * (fastest * ahead * q->step + fabs(p[AT] - p[LAST_AT]) * ahead) + margin;
        double gap[STRIDE], room[STRIDE];
        for (int64_t i = columns; i < LANES * blocks; i++) gap[i] = room[i] = 1.0e300;
        for (int64_t j = 0; j < q->rows; j++) {
            const double *restrict x = q->state + j * ROW, *restrict y = x + STRIDE, *restrict z = x + 2 * STRIDE;
#pragma omp simd
            for (int64_t i = 0; i < columns; i++) {
                double away = sqrt(x[i] * x[i] + y[i] * y[i]), u = side_s * (away - s0), w = side_z * (z[i] - z0);
                double ou = most(u, 0.0), ow = most(w, 0.0);
                gap[i] = sqrt(ou * ou + ow * ow) + least(most(u, w), 0.0) - off;
                room[i] = -u;
            }
            for (int64_t b = 0; b < blocks; b++) {
                double g = 1.0e300, r = 1.0e300;
#pragma omp simd reduction(min : g, r)
                for (int64_t i = LANES * b; i < LANES * (b + 1); i++) g = least(g, gap[i]), r = least(r, room[i]);
                q->touching[j * blocks + b] += digit * (g >= way ? CLEAR : r > way ? ON_FACE : TOUCHING);
                deepest = most(deepest, -g);
            }
        }
    }
    found[FASTEST] = fastest;
    found[WARP_SQUARED] = warp;
    found[WEFT_SQUARED] = weft;
    found[LEAST_SQUARED] = shortest;
    found[TANGENT] = tangent;
    found[PENETRATION] = deepest;
    found[MOVING] = moving;
    uint64_t bits; /* compiled for finite numbers, so it looks at the exponent itself */
    memcpy(&bits, &sum, 8);
    found[FINITE] = (bits >> 52 & 0x7FF) != 0x7FF;
}

/* Nothing but multiply-adds on 512 numbers, 16 on each per repeat: the peak of the processor. */
void multiply_add(double *restrict v, int64_t repeats)
{
    typedef double Wide __attribute__((vector_size(64), aligned(8)));
    for (int64_t k = 0; k < repeats; k++)
        for (int64_t i = 0; i < 512; i += 128) {
            /* sixteen vectors beside each other, so that none waits for itself */
            Wide x[16];
#pragma GCC unroll 16
            for (int l = 0; l < 16; l++) x[l] = *(const Wide *)(v + i + 8 * l);
#pragma GCC unroll 16
            for (int m = 0; m < 16; m++)
#pragma GCC unroll 16
                for (int l = 0; l < 16; l++) x[l] = x[l] * 0.5 + 0.01;
#pragma GCC unroll 16
            for (int l = 0; l < 16; l++) *(Wide *)(v + i + 8 * l) = x[l];
        }
}
