// SPDX-License-Identifier: BSD-3-Clause
// Digits of the problems that have no closed form, by extrapolation in arithmetic of 113 bits. Each mode of friction
// or contact has its own smooth equations; its end is found by roots of the length of the last step. Plane linkages
// have their masses, closures and loads written by hand.
//
//     integrated_digits falling > friction_falling.csv
//     integrated_digits guide > friction_guide.csv
//     integrated_digits driven > friction_driven.csv
//     integrated_digits pair > friction_pair.csv
//     integrated_digits pin > friction_pin.csv
//     integrated_digits drop > compliant_drop.csv
//     integrated_digits loose > compliant_pin.csv
//     integrated_digits loose_friction > compliant_pin_friction.csv
//     integrated_digits servo > servo_cylinder.csv
//     integrated_digits delay > delayed_crank.csv
#include "../../examples/references/quad.h"
#include <stdbool.h>

static const quad G = 9.81Q, ALLOWED = 1e-22Q;

// -- rows of a table ------------------------------------------------------------------------------------------------

static void number(quad x)
{
    char text[80];
    quadmath_snprintf(text, sizeof text, "%.18Qg", fabsq(x) < 1e-25Q ? 0 : x);
    printf(",%s", text);
}

// A state at t, or an event with the state there.
static void say(const char *set, quad t, const char *event, int count, const quad *x)
{
    printf("%s", set);
    number(t);
    printf(",%s", event);
    for (int k = 0; k < count; k++)
        if (isnanq(x[k]))
            printf(",");
        else
            number(x[k]);
    printf("\n");
}

#define SAY(set, t, event, ...) say(set, t, event, sizeof(quad[]){__VA_ARGS__} / sizeof(quad), (quad[]){__VA_ARGS__})
#define NONE                    nanq("")

// -- steps up to an event -------------------------------------------------------------------------------------------

typedef quad gap_function(quad t, const quad *x);

// The length of a step from x at which the gap is zero; it is positive at `low` and negative at `high`.
static quad root(rates_function *rates, int n, quad t, const quad *x, gap_function *gap, quad low, quad high)
{
    quad out[MOST], a = low, b = high, fa, fb;
    extrapolated(rates, t, n, x, a, out);
    fa = a == 0 ? gap(t, x) : gap(t + a, out);
    extrapolated(rates, t, n, x, b, out);
    fb = gap(t + b, out);
    for (int k = 0; k < 300 && fabsq(b - a) > 1e-31Q * fmaxq(t, 1e-3Q); k++) {
        quad c = k % 3 == 2 ? (a + b) / 2 : (a * fb - b * fa) / (fb - fa);
        extrapolated(rates, t, n, x, c, out);
        quad fc = gap(t + c, out);
        if (fc == 0)
            return c;
        if (fc > 0) {
            a = c;
            fa = fc;
            fb /= k % 3 == 1 ? 2 : 1;
        } else {
            b = c;
            fb = fc;
            fa /= k % 3 == 1 ? 2 : 1;
        }
    }
    return (a + b) / 2;
}

// Steps until the gap, which is positive from the beginning on, becomes negative, or to the end. True: at a gap of
// zero.
static bool until(rates_function *rates, int n, quad *t, quad *x, quad end, quad first, quad longest, gap_function *gap)
{
    quad h = first, out[MOST];
    bool begun = false;
    while (*t < end) {
        quad step = fminq(fminq(h, longest), end - *t);
        quad error = extrapolated(rates, *t, n, x, step, out);
        quad factor = fmaxq(0.2Q, fminq(3, 0.9Q * powq(ALLOWED / fmaxq(error, 1e-40Q), 1 / (2.Q * COLUMNS - 1))));
        h = step * factor;
        if (error > ALLOWED)
            continue;
        if (gap && gap(*t + step, out) < 0) {
            if (!begun) {
                fprintf(stderr, "the mode ends where it begins, at t = %g\n", (double)*t);
                exit(1);
            }
            quad at = root(rates, n, *t, x, gap, 0, step);
            extrapolated(rates, *t, n, x, at, out);
            memcpy(x, out, (size_t)n * sizeof *x);
            *t += at;
            return true;
        }
        begun = true;
        memcpy(x, out, (size_t)n * sizeof *x);
        *t = step == end - *t ? end : *t + step;
    }
    return false;
}

// -- a block on a belt whose friction falls with the rate -------------------------------------------------------------

static const quad BELT = 0.2Q;

static void falling_rates(quad t, const quad *x, quad *rate)
{
    (void)t;
    rate[0] = x[1];
    rate[1] = -x[0] + 1 / (1 + 3 * (BELT - x[1]));
}

static quad falling_gap(quad t, const quad *x)
{
    (void)t;
    return BELT - x[1];
}

static void falling(void)
{
    quad t = 0, x[2] = {0, BELT}, end = 18;
    printf("# extrapolation in 113 bits, each mode to its end\n# model: tests/models/friction_falling.yaml\n"
           "set,t,event,q.s,qd.s\n");
    SAY("", t, "friction 'rub' sticks", NONE, NONE);
    for (;;) {
        t += (1 - x[0]) / BELT;
        if (t > end)
            break;
        x[0] = 1;
        x[1] = BELT;
        SAY("", t, "friction 'rub' slips backward", 1 - BELT * t, 0);
        if (!until(falling_rates, 2, &t, x, end, 1e-3Q, 0.1Q, falling_gap))
            break;
        SAY("", t, "friction 'rub' sticks", x[0] - BELT * t, 0);
    }
    SAY("", end, "", NONE, NONE);
}

// -- plane linkages: angles of crank and rod, and a third body --------------------------------------------------------

typedef struct linkage {
    quad r, l, mass[3], centre[3], inertia[3]; // the third body: a rocker about (base, 0) of length `far`, or a slider
    quad base, far;                            // far 0: a slider along x
    quad push[3];                              // direction of the friction
} linkage;

static const linkage slider_crank = {0.1Q, 0.3Q, {1, 0.6Q, 0.8Q}, {0.05Q, 0.15Q, 0}, {0.01Q / 12, 0.054Q / 12, 0},
                                     0,    0,    {0, 0, 1}};
static const linkage four_bar = {0.3Q, 0.8Q, {1, 1, 1}, {0.15Q, 0.4Q, 0.35Q}, {0.09Q / 12, 0.64Q / 12, 0.49Q / 12},
                                 0.9Q, 0.7Q, {0, 1, -1}};

static const linkage *now;
static quad sense, mu, pivot, level; // the side of slip, what limits it

typedef struct place {
    quad p[3], v[3], mass[9], load[3], rows[6], bias[2];
} place;

static place at(quad a, quad w)
{
    const linkage *k = now;
    place s = {.p = {a}, .v = {w}};
    quad *p = s.p, *v = s.v;
    if (k->far > 0) { // circles about the crank's pin and the rocker's one; the upper one of their two points
        quad bx = k->r * cosq(a), by = k->r * sinq(a), dx = k->base - bx, dy = -by, d2 = dx * dx + dy * dy;
        quad along = (k->l * k->l - k->far * k->far + d2) / (2 * d2), off = sqrtq(k->l * k->l / d2 - along * along);
        quad cx = along * dx - off * dy, cy = along * dy + off * dx;
        p[1] = atan2q(cy, cx);
        p[2] = atan2q(by + cy, bx + cx - k->base);
    } else {
        p[1] = -asinq(k->r * sinq(a) / k->l);
        p[2] = k->r * cosq(a) + k->l * cosq(p[1]);
    }
    quad sa = sinq(a), ca = cosq(a), sb = sinq(p[1]), cb = cosq(p[1]), sd = sinq(p[2]), cd = cosq(p[2]);
    bool slides = k->far == 0;
    quad rows[6] = {-k->r * sa, -k->l * sb, slides ? -1 : k->far * sd, k->r * ca, k->l * cb, slides ? 0 : -k->far * cd};
    memcpy(s.rows, rows, sizeof rows);
    quad det = rows[1] * rows[5] - rows[2] * rows[4];
    v[1] = -(rows[0] * rows[5] - rows[2] * rows[3]) / det * w;
    v[2] = -(rows[1] * rows[3] - rows[0] * rows[4]) / det * w;
    quad cross = k->mass[1] * k->r * k->centre[1], turn = sinq(a - p[1]);
    s.mass[0] = k->inertia[0] + k->mass[0] * squared(k->centre[0]) + k->mass[1] * squared(k->r);
    s.mass[1] = s.mass[3] = cross * cosq(a - p[1]);
    s.mass[4] = k->inertia[1] + k->mass[1] * squared(k->centre[1]);
    s.mass[8] = slides ? k->mass[2] : k->inertia[2] + k->mass[2] * squared(k->centre[2]);
    s.load[0] = -cross * turn * v[1] * v[1] - G * (k->mass[0] * k->centre[0] + k->mass[1] * k->r) * ca;
    s.load[1] = cross * turn * v[0] * v[0] - G * k->mass[1] * k->centre[1] * cb;
    s.load[2] = slides ? 0 : -G * k->mass[2] * k->centre[2] * cd;
    s.bias[0] = -k->r * ca * v[0] * v[0] - k->l * cb * v[1] * v[1] + (slides ? 0 : k->far * cd * v[2] * v[2]);
    s.bias[1] = -k->r * sa * v[0] * v[0] - k->l * sb * v[1] * v[1] + (slides ? 0 : k->far * sd * v[2] * v[2]);
    return s;
}

// Accelerations and the force on the rod's end at a friction f.
static void balance(const place *s, quad f, quad *x)
{
    quad a[25] = {0};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            a[5 * i + j] = s->mass[3 * i + j];
        for (int j = 0; j < 2; j++) {
            a[5 * i + 3 + j] = -s->rows[3 * j + i];
            a[5 * (3 + j) + i] = s->rows[3 * j + i];
        }
        x[i] = s->load[i] + now->push[i] * f;
    }
    x[0] += pivot;
    x[3] = -s->bias[0];
    x[4] = -s->bias[1];
    solve(5, a, x);
}

// The guide's load at a force on the rod's end.
static quad guide_load(quad up)
{
    return now->mass[2] * G + up;
}

// The size of the load that presses, mu |guide| or mu |reaction|, by the friction itself: f = -sense level(f).
static quad friction(const place *s)
{
    quad x0[5], x1[5];
    if (mu == 0)
        return -sense * level;
    balance(s, 0, x0);
    balance(s, 1, x1);
    quad dx = x1[3] - x0[3], dy = x1[4] - x0[4];
    if (now->far == 0) { // |n| on both of its sides
        quad n0 = guide_load(x0[4]), f = -sense * mu * n0 / (1 + sense * mu * dy);
        return n0 + dy * f >= 0 ? f : sense * mu * n0 / (1 - sense * mu * dy);
    }
    quad a = 1 - mu * mu * (dx * dx + dy * dy), b = -mu * mu * (x0[3] * dx + x0[4] * dy),
         c = -mu * mu * (x0[3] * x0[3] + x0[4] * x0[4]);
    return (-b - sense * sqrtq(b * b - a * c)) / a;
}

static void linkage_rates(quad t, const quad *x, quad *rate)
{
    (void)t;
    place s = at(x[0], x[1]);
    quad out[5];
    balance(&s, friction(&s), out);
    rate[0] = x[1];
    rate[1] = out[0];
}

static quad slip(quad a, quad w)
{
    place s = at(a, w);
    return now->push[0] * s.v[0] + now->push[1] * s.v[1] + now->push[2] * s.v[2];
}

static quad slip_gap(quad t, const quad *x)
{
    (void)t;
    return sense * slip(x[0], x[1]);
}

// The friction that keeps a linkage at rest, and the largest one there.
static quad holding(quad angle, quad *largest, quad *force)
{
    place s = at(angle, 0);
    quad a[9], x[3];
    for (int i = 0; i < 3; i++) {
        a[3 * i] = s.rows[i];
        a[3 * i + 1] = s.rows[3 + i];
        a[3 * i + 2] = now->push[i];
        x[i] = -s.load[i];
    }
    solve(3, a, x);
    *largest = mu * (now->far == 0 ? fabsq(guide_load(x[1])) : hypotq(x[0], x[1]));
    memcpy(force, x, 2 * sizeof *force);
    return x[2];
}

static quad excess(quad angle)
{
    quad largest, force[2], f = holding(angle, &largest, force);
    return fabsq(f) - largest;
}

static quad zero(quad function(quad), quad low, quad high)
{
    bool rises = function(low) < 0;
    for (int k = 0; k < 120; k++) {
        quad c = (low + high) / 2;
        *((function(c) < 0) == rises ? &low : &high) = c;
    }
    return (low + high) / 2;
}

// A run of a linkage with one friction by the load that presses, up to the end.
static void run_linkage(const char *name, quad a, quad w, quad end, bool guide)
{
    quad t = 0, x[2] = {a, w}, none = NONE;
    char text[80];
    for (;;) {
        snprintf(text, sizeof text, "friction '%s' slips %s", name, sense > 0 ? "forward" : "backward");
        place s = at(x[0], x[1]);
        quad acceleration[5];
        balance(&s, friction(&s), acceleration);
        SAY("", t, text, guide ? x[0] : none, guide && t > 0 ? x[1] : none, t == 0 ? acceleration[0] : none, none, none,
            none);
        if (!until(linkage_rates, 2, &t, x, end, 1e-4Q, 0.02Q, slip_gap))
            break;
        if (fabsq(x[1]) < 1e-9Q) {
            x[1] = 0;
            if (excess(x[0]) < 0)
                break;
        }
        sense = -sense;
    }
    if (t == end) {
        SAY("", t, "", x[0], x[1], none, none, none, none);
        return;
    }
    quad largest, force[2], f = holding(x[0], &largest, force);
    snprintf(text, sizeof text, "friction '%s' sticks", name);
    SAY("", t, text, none, none, none, none, none, none);
    SAY("", end, "", x[0], 0, 0, -force[0], -force[1], f);
}

// Just inside and just outside the ends of the states of rest.
static void rest_set(const char *element, quad function(quad), int count, const quad (*ends)[2], const quad *inwards,
                     const char *const *outside, int columns)
{
    for (int k = 0; k < count; k++) {
        quad end = zero(function, ends[k][0], ends[k][1]);
        for (int out = 0; out < 2; out++) {
            quad a = end + (out ? -1 : 1) * inwards[k] * 1e-9Q;
            char set[80], number[60];
            quadmath_snprintf(number, sizeof number, "%.20Qg", a);
            snprintf(set, sizeof set, "th0=%s w=0", number);
            printf("%s,0,friction '%s' %s", set, element, out ? outside[k] : "sticks");
            for (int c = 0; c < columns; c++)
                printf(",");
            printf("\n%s,0.001,,", set);
            printf(out ? "," : "%s,0", number);
            for (int c = 2; c < columns; c++)
                printf(",");
            printf("\n");
        }
    }
}

// The growth of the guide's load with the friction.
static quad growth(quad angle)
{
    quad x0[5], x1[5];
    place s = at(angle, 1);
    balance(&s, 0, x0);
    balance(&s, 1, x1);
    return fabsq(x1[4] - x0[4]);
}

// Slip has two solutions or none where the level grows by more than 1 for each unit of friction.
static void unique(void)
{
    quad low = 5.6Q, high = 5.8Q;
    for (int k = 0; k < 100; k++) {
        quad third = (high - low) / 3;
        *(growth(low + third) < growth(high - third) ? &low : &high) +=
            growth(low + third) < growth(high - third) ? third : -third;
    }
    for (int above = 0; above < 2; above++) {
        char limit[60];
        quadmath_snprintf(limit, sizeof limit, "%.20Qg", (1 + (above ? 1e-9Q : -1e-9Q)) / growth(low));
        for (int k = 0; k <= above; k++)
            printf("th0=%.17g w=15 mu=%s,0,%s,,,,,,\n", (double)low, limit,
                   k < above ? "growth the level of 'guide' grows by 1 for each" : "friction 'guide' slips forward");
        if (above)
            printf("th0=%.17g w=15 mu=%s,0,solutions force 'guide' has two solutions,,,,,,\n", (double)low, limit);
        printf("th0=%.17g w=15 mu=%s,1e-9,,,,,,,\n", (double)low, limit);
    }
    for (int side = -1; side < 2; side += 2) {
        static const char *const said[3] = {"refused 'guide' can neither slip nor stick at t = 0", "",
                                            "friction 'guide' slips forward"};
        if (side > 0)
            printf("th0=300deg w=15 mu=10,0,growth the level of 'guide' grows by 1.366 for each,,,,,,\n");
        printf("th0=300deg w=%d mu=10,0,%s,,,,,,\n", 15 * side, said[side + 1]);
        if (side > 0)
            printf("th0=300deg w=15 mu=10,0,solutions force 'guide' has two solutions,,,,,,\n"
                   "th0=300deg w=15 mu=10,1e-9,,,,,,,\n");
    }
}

static void guide(void)
{
    now = &slider_crank;
    mu = 0.4Q;
    printf("# extrapolation in 113 bits, each mode to its end; the states of rest by statics\n"
           "# model: tests/models/friction_guide.yaml\n"
           "set,t,event,q.th,qd.th,qdd.th,lambda.C.1,lambda.C.2,force.guide\n");
    sense = -1;
    run_linkage("guide", degrees(60), 15, 1, true);
    quad t = 0, x[2] = {0, 0}, none = NONE;
    sense = -1; // the slider moves inwards from its dead centre, where the friction is not determined
    until(linkage_rates, 2, &t, x, 0.1Q, 1e-4Q, 0.02Q, NULL);
    SAY("th0=0 w=0", t, "", x[0], x[1], none, none, none, none);
    static const quad ends[4][2] = {{0.9Q, 1}, {1.9Q, 2}, {4.2Q, 4.4Q}, {5.3Q, 5.4Q}}, inwards[4] = {1, -1, 1, -1};
    static const char *const outside[4] = {"slips forward", "slips backward", "slips forward", "slips backward"};
    rest_set("guide", excess, 4, ends, inwards, outside, 6);
    unique();
}

// Torque of the drive and load of the guide at a constant rate of the crank.
static void driven(void)
{
    now = &slider_crank;
    mu = 0.4Q;
    printf("# statics with known accelerations, in 113 bits\n# model: tests/models/friction_driven.yaml\n"
           "set,t,event,lambda.th.1,lambda.C.2\n");
    static const int angle[] = {30, 90, 150};
    for (int k = 0; k < 3; k++) {
        quad a = degrees(angle[k]), w = 20, up[2], torque[2];
        place s = at(a, w);
        quad det = s.rows[1] * s.rows[5] - s.rows[2] * s.rows[4];
        quad turn = -(s.bias[0] * s.rows[5] - s.rows[2] * s.bias[1]) / det,
             out = -(s.rows[1] * s.bias[1] - s.bias[0] * s.rows[4]) / det;
        for (int f = 0; f < 2; f++) { // (torque, force on the rod's end) at no friction and at that of 1 N
            quad m[9] = {1, s.rows[0], s.rows[3], 0, s.rows[1], s.rows[4], 0, s.rows[2], s.rows[5]};
            quad x[3] = {s.mass[1] * turn - s.load[0], s.mass[4] * turn - s.load[1], s.mass[8] * out - s.load[2] - f};
            solve(3, m, x);
            torque[f] = x[0];
            up[f] = x[2];
        }
        quad n0 = guide_load(up[0]), dn = up[1] - up[0], side = s.v[2] > 0 ? 1 : -1;
        quad f = -side * mu * n0 / (1 + side * mu * dn);
        f = n0 + dn * f >= 0 ? f : side * mu * n0 / (1 - side * mu * dn);
        SAY("", a / w, "", torque[0] + (torque[1] - torque[0]) * f, -(up[0] + (up[1] - up[0]) * f));
    }
}

static quad gravity_over_levels(quad angle)
{
    return fabsq(0.7848Q * cosq(angle)) - 0.5Q - 3 * fabsq(slip(angle, 1));
}

static void pair(void)
{
    now = &slider_crank;
    mu = 0;
    level = 3;
    pivot = 0.5Q; // the crank turns backwards
    sense = 1;
    quad t = 0, x[2] = {degrees(5), 0};
    printf("# extrapolation in 113 bits, each mode to its end; the states of rest by statics\n"
           "# model: tests/models/friction_pair.yaml\nset,t,event,q.th,qd.th\n");
    SAY("", t, "friction 'pivot' slips backward", NONE, NONE);
    SAY("", t, "friction 'guide' slips forward", NONE, NONE);
    until(linkage_rates, 2, &t, x, 1, 1e-4Q, 0.02Q, slip_gap);
    SAY("", t, "friction 'guide' slips backward", x[0], x[1]);
    sense = -1;
    until(linkage_rates, 2, &t, x, 1, 1e-4Q, 0.02Q, slip_gap);
    SAY("", t, "friction 'pivot' sticks", NONE, NONE);
    SAY("", t, "friction 'guide' sticks", NONE, NONE);
    SAY("", 1, "", x[0], 0);
    quad end = zero(gravity_over_levels, 0.4Q, 0.6Q);
    for (int out = 0; out < 2; out++) {
        char number[60];
        quadmath_snprintf(number, sizeof number, "%.20Qg", end + (out ? -1e-9Q : 1e-9Q));
        printf("th0=%s,0,friction 'pivot' %s,,\nth0=%s,0,friction 'guide' %s,,\nth0=%s,0.001,,", number,
               out ? "slips backward" : "sticks", number, out ? "slips forward" : "sticks", number);
        printf(out ? ",\n" : "%s,0\n", number);
    }
}

static void pin(void)
{
    now = &four_bar;
    mu = 0.1Q;
    sense = slip(M_PIq / 2, 1.5Q) > 0 ? 1 : -1;
    printf("# extrapolation in 113 bits, each mode to its end\n# model: tests/models/friction_pin.yaml\n"
           "set,t,event,q.A,qd.A,qdd.A,lambda.C.1,lambda.C.2,force.pin\n");
    run_linkage("pin", M_PIq / 2, 1.5Q, 10, true);
}

// -- compliant contact ------------------------------------------------------------------------------------------------

static bool touching;

static quad power(quad depth)
{
    return depth > 0 ? depth * sqrtq(depth) : -(-depth * sqrtq(-depth));
}

static void drop_rates(quad t, const quad *x, quad *rate)
{
    (void)t;
    rate[0] = x[1];
    rate[1] = -G + (touching ? 1e6Q * power(-x[0]) * (1 - 0.2Q * x[1]) : 0);
}

static quad drop_gap(quad t, const quad *x)
{
    (void)t;
    return touching ? -x[0] : x[0];
}

static void drop(void)
{
    quad t = sqrtq(0.2Q / G), x[2] = {0, -sqrtq(0.2Q * G)}, end = 0.9Q;
    printf("# extrapolation in 113 bits, each contact to its end\n# model: tests/models/compliant_drop.yaml\n# atol: "
           "1e-14\n"
           "set,t,event,q.z,qd.z\n");
    for (;;) {
        SAY("", t, "event contact 'floor' closes", 0, x[1]);
        touching = true;
        if (!until(drop_rates, 2, &t, x, end, 1e-10Q, 1e-3Q, drop_gap))
            break;
        SAY("", t, "event contact 'floor' opens", 0, x[1]);
        quad flight = 2 * x[1] / G;
        if (t + flight > end) {
            quad s = end - t;
            x[0] = x[1] * s - G * s * s / 2;
            x[1] -= G * s;
            break;
        }
        t += flight;
        x[0] = 0;
        x[1] = -x[1];
    }
    SAY("", end, "", x[0], x[1]);
}

// A slider-crank whose rod turns in a bearing of the slider with play; the crank's angle is known.
static const quad CRANK = 0.05Q, ROD = 0.12Q, CENTRE = 0.06Q, ROD_MASS = 0.21Q, ROD_INERTIA = 2.5e-4Q, SLIDER = 0.14Q,
                  PLAY = 5e-4Q;
static quad speed, stiffness, impact, rubbing;

static void journal(quad t, const quad *x, quad *e, quad *ed)
{
    quad c = cosq(x[0]), s = sinq(x[0]), cw = cosq(speed * t), sw = sinq(speed * t);
    e[0] = CRANK * cw + ROD * c - x[2];
    e[1] = CRANK * sw + ROD * s;
    ed[0] = -CRANK * speed * sw - ROD * s * x[1] - x[3];
    ed[1] = CRANK * speed * cw + ROD * c * x[1];
}

static void loose_rates(quad t, const quad *x, quad *rate)
{
    quad c = cosq(x[0]), s = sinq(x[0]), e[2], ed[2], force[2] = {0, 0}, pull = CRANK * speed * speed;
    if (touching) {
        journal(t, x, e, ed);
        quad size = hypotq(e[0], e[1]), nx = e[0] / size, ny = e[1] / size, rate_in = nx * ed[0] + ny * ed[1];
        quad n = stiffness * power(size - PLAY) * (1 + 0.75Q * (1 - 0.81Q) * rate_in / impact);
        quad rub = rubbing * n * tanhq((nx * ed[1] - ny * ed[0]) / 0.01Q);
        force[0] = -n * nx + rub * ny;
        force[1] = -n * ny - rub * nx;
    }
    quad moment =
        ROD_MASS * CENTRE * pull * (c * sinq(speed * t) - s * cosq(speed * t)) + ROD * (c * force[1] - s * force[0]);
    rate[0] = x[1];
    rate[1] = moment / (ROD_INERTIA + ROD_MASS * CENTRE * CENTRE);
    rate[2] = x[3];
    rate[3] = -force[0] / SLIDER;
}

static quad play_gap(quad t, const quad *x)
{
    quad e[2], ed[2];
    journal(t, x, e, ed);
    return touching ? hypotq(e[0], e[1]) - PLAY : PLAY - hypotq(e[0], e[1]);
}

static void loose_pin(const char *model, quad friction_of_pin, quad end)
{
    speed = 5000 * M_PIq / 30;
    rubbing = friction_of_pin;
    stiffness = 4 / (3 * 2 * (1 - 0.09Q) / 207e9Q) * sqrtq(0.01Q * 0.0095Q / PLAY);
    quad t = 0, x[4] = {0, -CRANK * speed / ROD, CRANK + ROD, 0}, e[2], ed[2];
    printf("# extrapolation in 113 bits, each contact to its end\n# model: tests/models/%s.yaml\n# atol: 1e-14\n"
           "set,t,event,q.B,qd.B,q.S,qd.S\n",
           model);
    touching = false;
    while (until(loose_rates, 4, &t, x, end, touching ? 1e-12Q : 1e-8Q, 1e-5Q, play_gap)) {
        touching = !touching;
        SAY("", t, touching ? "event contact 'pin' closes" : "event contact 'pin' opens", x[0] - speed * t,
            x[1] - speed, x[2], x[3]);
        journal(t, x, e, ed);
        impact = (e[0] * ed[0] + e[1] * ed[1]) / hypotq(e[0], e[1]);
    }
    SAY("", t, "", x[0] - speed * t, x[1] - speed, x[2], x[3]);
}

static void loose(void)
{
    loose_pin("compliant_pin", 0, 0.0009Q);
}

static void loose_friction(void)
{
    loose_pin("compliant_pin_friction", 0.1Q, 0.0009Q);
}

// -- a cylinder that is fed through an orifice
// --------------------------------------------------------------------------

static void servo_rates(quad t, const quad *x, quad *rate)
{
    (void)t;
    rate[0] = x[1];
    rate[1] = (2e-3Q * x[2] - 5000 - 1000 * x[1]) / 200;
    rate[2] = 1.2e9Q / (1e-3Q + 2e-3Q * x[0]) * (2e-8Q * sqrtq(14e6Q - x[2]) - 2e-3Q * x[1]);
}

static void servo(void)
{
    quad t = 0, x[3] = {0, 0, 2.5e6Q};
    until(servo_rates, 3, &t, x, 0.5Q, 1e-4Q, 1e-2Q, NULL);
    printf("# extrapolation in 113 bits\nset,t,event,q.x,qd.x,state.p\n");
    SAY("", t, "", x[0], x[1], x[2]);
}

// -- a slider-crank whose controller sees its crank one delay later ---------------------------------------------------

// By the method of steps: the motions of all intervals of the length of the delay at once, each of which drives the
// next one. No motion is interpolated.
enum { INTERVALS = 20 };
static int intervals;
static quad crank_at_start;

static void delay_rates(quad t, const quad *x, quad *rate)
{
    (void)t;
    for (int k = 0; k < intervals; k++) {
        quad seen = k > 0 ? x[2 * k - 2] : crank_at_start, seen_rate = k > 0 ? x[2 * k - 1] : 0, out[5];
        pivot = 2 * (2 - seen) - 0.1Q * seen_rate;
        place s = at(x[2 * k], x[2 * k + 1]);
        balance(&s, 0, out);
        rate[2 * k] = x[2 * k + 1];
        rate[2 * k + 1] = out[0];
    }
}

static void delay(void)
{
    const quad time = 0.04Q;
    quad begin[2 * INTERVALS + 2];
    now = &slider_crank;
    begin[0] = crank_at_start = M_PIq / 3;
    begin[1] = 0;
    printf("# extrapolation in 113 bits, by the method of steps\nset,t,event,q.th,qd.th,q.x,qd.x,state.angle\n");
    for (intervals = 1; intervals <= INTERVALS; intervals++) {
        quad t = 0, x[2 * INTERVALS];
        memcpy(x, begin, (size_t)(2 * intervals) * sizeof *x);
        until(delay_rates, 2 * intervals, &t, x, time, 1e-4Q, 1e-2Q, NULL);
        quad *end = begin + 2 * intervals;
        memcpy(end, x + 2 * intervals - 2, 2 * sizeof *end);
        place s = at(end[0], end[1]);
        if (intervals % 5 == 0)
            SAY("", intervals * time, "", end[0], end[1], s.p[2], s.v[2], begin[2 * intervals - 2]);
    }
}

int main(int argc, char **argv)
{
    static const struct {
        const char *name;
        void (*write)(void);
    } problems[] = {{"falling", falling}, {"guide", guide}, {"driven", driven}, {"pair", pair},
                    {"pin", pin},         {"drop", drop},   {"loose", loose},   {"loose_friction", loose_friction},
                    {"servo", servo},     {"delay", delay}};
    for (size_t k = 0; argc == 2 && k < sizeof problems / sizeof *problems; k++)
        if (strcmp(argv[1], problems[k].name) == 0) {
            problems[k].write();
            return 0;
        }
    fprintf(stderr, "usage: integrated_digits PROBLEM\n");
    return 2;
}
