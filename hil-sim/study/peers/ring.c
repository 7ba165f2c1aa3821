/* The ring's own equations as a general solver wants them: forces and rates from a
 * state, no time stepping. Same wall, same elements, same law of pressure as
 * hil-sim/src/plant; written out again so that it can disagree with it.
 *
 * Lengths in mm, forces in N, times in s, stiffness per area in N/mm^3.
 */
#include <math.h>
#include <stddef.h>

typedef struct {
    double radius, width, k_inf, k_0, tau, step, speed, preload, start, pitch;
    double damping; /* N s/mm, of the regularised balance */
    long count;     /* elements carried as states */
    const double *angle; /* of each at the start, rad from straight down, positive ahead */
} Problem;

typedef struct {
    double cosine, sine, slope, floor_pressure;
} Contact;

/* Distance along the ray to the wall, whether it meets the wall under the centre or
 * behind it, and its derivative by the centre's height. */
static double ray(const Problem *p, double x, double y, double s, double c, int *floor,
                  double *by_height) {
    *floor = 1;
    *by_height = 1.0 / c;
    if (x < 0.0) {
        if (y * s > -x * c) {
            *floor = 0;
            if ((y - p->step) * s <= -x * c) {
                *by_height = 0.0;
                return -x / s;
            }
            return (y - p->step) / c;
        }
        return y / c;
    }
    /* Beyond the face the wheel stands on the upper wall, which ends behind it. */
    if (-(y - p->step) * s > x * c) return y / c;
    return (y - p->step) / c;
}

/* Part of an element's width that lies on the upper wall's side of its edge. */
static double covered(const Problem *p, double x, double y, double s, double c) {
    if (x < 0.0) return 1.0;
    double h = y - p->step, d = hypot(x, h);
    double part = 0.5 + (x / d * c + h / d * s) / p->pitch;
    return part < 0.0 ? 0.0 : part > 1.0 ? 1.0 : part;
}

/* Contact at time t and centre height y (above the lower wall); the depths, cut at
 * zero, go to `depth` unless that is NULL. */
static Contact contact(const Problem *p, double t, double y, const double *q, double *depth) {
    Contact out = {0.0, 0.0, 0.0, -INFINITY};
    double way = p->speed * t, x = p->start + way, turned = way / p->radius;
    double patch = p->pitch * p->radius * p->width, excess = p->k_0 - p->k_inf;
    double above = x < 0.0 ? y - p->step : y - p->step;
    double reach = acos(fmin(1.0, fmax(-1.0, fmin(above, y) / p->radius)));
    for (long i = 0; i < p->count; i++) {
        double psi = p->angle[i] - turned;
        if (depth) depth[i] = 0.0;
        if (psi > reach || psi < -reach) continue;
        double s = sin(psi), c = cos(psi), by;
        int floor;
        double part = covered(p, x, y, s, c);
        double far;
        if (part > 0.0 && part < 1.0) {
            far = (y - p->step) / c;
            floor = 1;
            by = 1.0 / c;
        } else {
            far = ray(p, x, y, s, c, &floor, &by);
            part = 1.0;
        }
        double d = p->radius - far;
        if (d <= 0.0) continue;
        if (depth) depth[i] = d;
        double pressure = p->k_inf * d + excess * (d - q[i]);
        if (floor && pressure > out.floor_pressure) out.floor_pressure = pressure;
        if (pressure <= 0.0) continue;
        out.cosine += pressure * patch * part * c;
        out.sine += pressure * patch * part * s;
        out.slope -= p->k_0 * by * patch * part * c;
    }
    if (out.floor_pressure == -INFINITY) out.floor_pressure = -p->k_inf * fabs(y - p->radius);
    return out;
}

/* Height at which the contact carries the preload; `y` holds the guess and takes it.
 * Newton inside a bracket. Returns the number of contact sums, negative if none is
 * found. */
static long balance(const Problem *p, double t, const double *q, double *y) {
    double base = p->start + p->speed * t < 0.0 ? 0.0 : p->step;
    double low = base + 0.2 * p->radius, high = base + 1.1 * p->radius + p->step, h = *y;
    for (long n = 1; n <= 80; n++) {
        Contact c = contact(p, t, h, q, NULL);
        double rest = c.cosine - p->preload;
        if (fabs(rest) <= 1e-9 * p->preload || high - low < 1e-13 * p->radius) {
            *y = h;
            return n;
        }
        if (rest > 0.0) low = h; else high = h;
        double newton = h - rest / c.slope;
        h = c.slope < 0.0 && newton > low && newton < high ? newton : 0.5 * (low + high);
    }
    return -1;
}

/* Rates of the internal displacements with the height eliminated. Returns the number
 * of contact sums that it took. */
long rates_reduced(const Problem *p, double t, const double *q, double *y, double *dq) {
    long sums = balance(p, t, q, y);
    if (sums < 0) return sums;
    contact(p, t, *y, q, dq);
    for (long i = 0; i < p->count; i++) dq[i] = (dq[i] - q[i]) / p->tau;
    return sums + 1;
}

/* Rates of internal displacements and height, the last state, with a damper beside
 * the contact: stiff, since the balance is reached within damping over slope. */
void rates_damped(const Problem *p, double t, const double *state, double *rate) {
    Contact c = contact(p, t, state[p->count], state, rate);
    for (long i = 0; i < p->count; i++) rate[i] = (rate[i] - state[i]) / p->tau;
    rate[p->count] = (c.cosine - p->preload) / p->damping;
}

/* Jacobian of rates_damped: the diagonal of the displacements is -1/tau; `column`
 * takes d(rate_i)/d(height), `row` d(rate of height)/d(q_i) and, last, by height. */
void jacobian_damped(const Problem *p, double t, const double *state, double *column,
                     double *row) {
    double y = state[p->count], way = p->speed * t, x = p->start + way;
    double turned = way / p->radius, patch = p->pitch * p->radius * p->width;
    for (long i = 0; i < p->count; i++) {
        double psi = p->angle[i] - turned, s = sin(psi), c = cos(psi), by;
        int floor;
        column[i] = row[i] = 0.0;
        if (c < 0.1) continue;
        double d = p->radius - ray(p, x, y, s, c, &floor, &by);
        if (d <= 0.0) continue;
        column[i] = -by / p->tau;
        if (p->k_inf * d + (p->k_0 - p->k_inf) * (d - state[i]) > 0.0)
            row[i] = -(p->k_0 - p->k_inf) * patch * c / p->damping;
    }
    row[p->count] = contact(p, t, y, state, NULL).slope / p->damping;
}

/* Height, axial force and floor pressure for reading a solution out. */
void read_out(const Problem *p, double t, const double *q, double y, double *out) {
    Contact c = contact(p, t, y, q, NULL);
    out[0] = y;
    out[1] = c.sine;
    out[2] = c.floor_pressure;
    out[3] = c.cosine;
}
