/* SPDX-License-Identifier: BSD-3-Clause */
/* Outputs of driven mechanisms and their derivatives by parameters: a coupler curve against Freudenstein's equation in
 * complex arithmetic, whose imaginary part at a step of 1e-30 is the derivative without any difference; velocities and
 * reactions against differences; the assembly mode kept over long ways; what cannot be had. */
#include "loaded.h"
#include <complex.h>
#include <kempe/gradient.h>
#include <kempe/kempe.h>

#define BODIES                                                                                                         \
    "ground: {points: {O: [x, y, 0], D: [x + base*cos(tilt), y + base*sin(tilt), 0]}}\n"                               \
    "bodies:\n"                                                                                                        \
    "  crank: {joint: {revolute: z, at: ground.O}, mass: 1, com: [crank/2, 0, 0], inertia: {zz: 0.01}, "               \
    "points: {B: [crank, 0, 0]}}\n"                                                                                    \
    "  coupler: {joint: {revolute: z, at: crank.B}, mass: 2, com: [coupler/3, across, 0], inertia: {zz: 0.05}, "       \
    "points: {C: [coupler, 0, 0], P: [along, across, 0]}}\n"                                                           \
    "  rocker: {joint: {revolute: z, at: ground.D}, mass: 1, com: [rocker/2, 0, 0], inertia: {zz: 0.04}, "             \
    "points: {C: [rocker, 0, 0]}}\n"                                                                                   \
    "loops: {C: {ball: [coupler.C, rocker.C]}}\n"                                                                      \
    "start: {q: {crank: 60 deg, coupler: -30 deg, rocker: 106 deg}, hold: [crank]}\n"
#define MODEL                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {crank: 0.3, coupler: 0.8, rocker: 0.7, base: 0.9, along: 0.5, across: 0.25, x: 0.1, y: -0.2, "       \
    "tilt: 0.15, twice: 2*coupler}\n" BODIES

enum { PARAMETERS = 9, CRANK = 0, COUPLER, ROCKER, BASE, ALONG, ACROSS, X, Y, TILT };

static const char names[] = "crank,coupler,rocker,base,along,across,x,y,tilt";
static const double start[PARAMETERS] = {0.3, 0.8, 0.7, 0.9, 0.5, 0.25, 0.1, -0.2, 0.15};

typedef double complex number;

/* The coupler point: cos(a - b) = K1 cos b - K2 cos a + K3 for the angles a of the crank and b of the rocker against
 * the base (Freudenstein 1955), solved for tan(b/2), the open mode. */
static void coupler_point(const number p[PARAMETERS], number angle, number point[2])
{
    number a = angle - p[TILT], k1 = p[BASE] / p[CRANK], k2 = p[BASE] / p[ROCKER];
    number k3 = (p[CRANK] * p[CRANK] - p[COUPLER] * p[COUPLER] + p[ROCKER] * p[ROCKER] + p[BASE] * p[BASE]) /
                (2 * p[CRANK] * p[ROCKER]);
    number c = ccos(a), A = c - k1 - k2 * c + k3, B = -2 * csin(a), C = k1 - (k2 + 1) * c + k3;
    number t = (-B - csqrt(B * B - 4 * A * C)) / (2 * A);
    number cb = (1 - t * t) / (1 + t * t), sb = 2 * t / (1 + t * t);
    number bx = p[CRANK] * c, by = p[CRANK] * csin(a);
    number ex = (p[BASE] + p[ROCKER] * cb - bx) / p[COUPLER], ey = (p[ROCKER] * sb - by) / p[COUPLER];
    number px = bx + p[ALONG] * ex - p[ACROSS] * ey, py = by + p[ALONG] * ey + p[ACROSS] * ex;
    point[0] = p[X] + ccos(p[TILT]) * px - csin(p[TILT]) * py;
    point[1] = p[Y] + csin(p[TILT]) * px + ccos(p[TILT]) * py;
}

/* Values and derivatives at once: worst distance. */
static double off_at(kempe_gradient *g, const double *values, double angle)
{
    double worst = 0;
    CHECK(kempe_gradient_eval(g, &angle, NULL, NULL) == KEMPE_OK);
    for (int k = 0; k <= PARAMETERS; k++) {
        number p[PARAMETERS], point[2];
        for (int i = 0; i < PARAMETERS; i++)
            p[i] = values[i] + (i == k ? 1e-30 * I : 0);
        coupler_point(p, angle + (k == PARAMETERS ? 1e-30 * I : 0), point);
        for (int i = 0; i < 2; i++) {
            double slope =
                k < PARAMETERS ? kempe_gradient_jacobian(g)[i * PARAMETERS + k] : kempe_gradient_by_driven(g)[i];
            worst = check_max(worst, fabs(kempe_gradient_values(g)[i] - creal(point[i])));
            worst = check_max(worst, fabs(slope - cimag(point[i]) / 1e-30));
        }
    }
    return worst;
}

static kempe_gradient *open_gradient(loaded *m, const char *text, const char *parameters)
{
    kempe_gradient_options options = {.parameters = parameters, .driven = "crank"};
    kempe_gradient *g = NULL;
    *m = load_text(text);
    if (kempe_gradient_new(m->model, &options, &g) != KEMPE_OK)
        printf("%s\n", kempe_context_message(m->context));
    CHECK(g != NULL);
    return g;
}

static void a_coupler_curve(void)
{
    loaded m;
    kempe_gradient *g = open_gradient(&m, MODEL "run: {outputs: [position(coupler.P)]}\n", names);
    double values[PARAMETERS], worst = 0;
    CHECK(kempe_gradient_count(g) == 3);
    CHECK_TEXT(kempe_gradient_name(g, 1), "position.coupler.P.y");
    CHECK_TEXT(kempe_gradient_name(g, 3), "");
    for (int k = 0; k < 48; k++)
        worst = check_max(worst, off_at(g, start, 1 + 2 * 3.141592653589793 * k / 24));
    /* other lengths, at once; far away, at once; and there with others again */
    memcpy(values, start, sizeof values);
    values[CRANK] = 0.2, values[ROCKER] = 0.9, values[TILT] = -0.4;
    CHECK(kempe_gradient_set(g, values) == KEMPE_OK);
    worst = check_max(worst, off_at(g, values, 2));
    worst = check_max(worst, off_at(g, values, 5));
    worst = check_max(worst, off_at(g, values, 2));
    CHECK(kempe_gradient_set(g, start) == KEMPE_OK);
    worst = check_max(worst, off_at(g, start, -1.4));
    printf("   off by %.1e\n", worst);
    CHECK(worst < 2e-14);
    kempe_gradient_free(g);
    unload(&m);
}

/* -- what depends on more than places ------------------------------------------------------------------ */

static void motion_and_reactions(void)
{
    loaded m;
    kempe_gradient *g = open_gradient(&m,
                                      MODEL "sensors: {angle: 'q(rocker)^2*qd(coupler)*twice'}\n"
                                            "run: {outputs: [velocity(coupler.P), acceleration(coupler.P), "
                                            "reaction(C), sensor(angle)]}\n",
                                      "crank,coupler,across");
    enum { VALUES = 10 };
    const double at = 1.3, rate = 4, acceleration = -3;
    double values[3] = {0.3, 0.8, 0.25}, exact[VALUES][4], best[4] = {INFINITY, INFINITY, INFINITY, INFINITY};
    CHECK(kempe_gradient_count(g) == VALUES);
    CHECK(kempe_gradient_eval(g, &at, &rate, &acceleration) == KEMPE_OK);
    for (int i = 0; i < VALUES; i++) {
        memcpy(exact[i], kempe_gradient_jacobian(g) + 3 * i, 3 * sizeof(double));
        exact[i][3] = kempe_gradient_by_driven(g)[i];
    }
    for (int k = 0; k < 4; k++)
        for (double step = 1e-3; step > 1e-7; step /= 10) {
            double side[2][VALUES], worst = 0, size = 0;
            for (int s = 0; s < 2; s++) {
                double moved[3] = {values[0], values[1], values[2]}, angle = at;
                *(k < 3 ? &moved[k] : &angle) += s ? -step : step;
                CHECK(kempe_gradient_set(g, moved) == KEMPE_OK);
                CHECK(kempe_gradient_eval(g, &angle, &rate, &acceleration) == KEMPE_OK);
                memcpy(side[s], kempe_gradient_values(g), sizeof side[s]);
            }
            for (int i = 0; i < VALUES; i++) {
                size = check_max(size, fabs(exact[i][k]));
                worst = check_max(worst, fabs((side[0][i] - side[1][i]) / (2 * step) - exact[i][k]));
            }
            best[k] = fmin(best[k], worst / size);
        }
    printf("   off by %.1e %.1e %.1e %.1e\n", best[0], best[1], best[2], best[3]);
    for (int k = 0; k < 4; k++)
        CHECK(best[k] < 1e-8);
    kempe_gradient_free(g);
    unload(&m);
}

/* -- what cannot be had ------------------------------------------------------------------------------ */

static void ways_that_end(void)
{
    loaded m;
    kempe_gradient *g = open_gradient(&m, MODEL "run: {outputs: [position(coupler.P)]}\n", names);
    double values[PARAMETERS], angle = 1, q[3];
    CHECK(kempe_gradient_eval(g, &angle, NULL, NULL) == KEMPE_OK);
    memcpy(q, kempe_gradient_q(g), sizeof q);
    memcpy(values, start, sizeof values);
    values[CRANK] = 0.8; /* it no longer turns all the way round */
    CHECK(kempe_gradient_set(g, values) == KEMPE_OK);
    angle = 3.2;
    CHECK(kempe_gradient_eval(g, &angle, NULL, NULL) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(m.context), "crank from 1 to 3.2 ends at"));
    CHECK(memcmp(q, kempe_gradient_q(g), sizeof q) == 0);
    values[COUPLER] = NAN;
    CHECK(kempe_gradient_set(g, values) == KEMPE_E_INPUT && strstr(kempe_context_message(m.context), "'coupler'"));
    CHECK(kempe_gradient_set(g, start) == KEMPE_OK);
    CHECK(off_at(g, start, 3.2) < 2e-14);
    angle = NAN;
    CHECK(kempe_gradient_eval(g, &angle, NULL, NULL) == KEMPE_E_ARGUMENT);
    kempe_gradient_free(g);
    unload(&m);
}

static void refuse(const char *text, const char *parameter, const char *driven, kempe_status status, const char *word)
{
    loaded m = load_text(text);
    kempe_gradient *g = NULL;
    kempe_gradient_options options = {.parameters = parameter, .driven = driven};
    CHECK(kempe_gradient_new(m.model, &options, &g) == status && g == NULL);
    CHECK(strstr(kempe_context_message(m.context), word));
    if (!strstr(kempe_context_message(m.context), word))
        printf("%s\n", kempe_context_message(m.context));
    unload(&m);
}

static void what_is_refused(void)
{
    refuse(MODEL, "cranks", "crank", KEMPE_E_ARGUMENT, "'cranks'");
    refuse(MODEL, "crank", "rockers", KEMPE_E_ARGUMENT, "'rockers'");
    refuse(MODEL, "crank", "rocker, rocker", KEMPE_E_ARGUMENT, "driven: coordinate 'rocker' is given twice");
    refuse(MODEL, "crank", "rocker, crank", KEMPE_E_FAILED, "2 independent coordinates");
    refuse(MODEL, "crank", NULL, KEMPE_E_FAILED, "0 coordinates are driven");
}

/* A slide of mass 2 under a cylinder of pressure p = 3 P + Q and a spring, driven at x with rate v and acceleration a:
 * the drive's force would be 2 a + k x - A p, and the rate of p is B (Q - A v). */
static void states_keep_their_start(void)
{
    static const char text[] =
        "kempe: 1\nparameters: {A: 0.4, k: 30, P: 2, Q: 0.7, B: 5}\n"
        "states: {p: {start: 3*P + Q, rate: B*(Q - A*qd(x))}}\n"
        "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
        "forces: {c: {joint: x, force: A*p - k*q(x)}}\n"
        "sensors: {f: \"A*p - k*q(x)\", w: p*qd(x)}\nrun: {outputs: [force(c), sensor(f), sensor(w)]}\n";
    const kempe_gradient_options options = {.parameters = "A,k,P,Q", .driven = "x"};
    const double x = 0.2, v = 0.3, a = 0.1;
    loaded m = load_text(text);
    kempe_gradient *g = NULL;
    CHECK(kempe_gradient_new(m.model, &options, &g) == KEMPE_OK);
    for (int round = 0; g && round < 2; round++) {
        const double values[] = {0.4, 30, round ? 5 : 2, 0.7}, p = 3 * values[2] + 0.7;
        const double exact[3][4] = {{p, -x, 3 * 0.4, 0.4}, {p, -x, 3 * 0.4, 0.4}, {0, 0, 3 * v, v}};
        CHECK(kempe_gradient_set(g, values) == KEMPE_OK && kempe_gradient_eval(g, &x, &v, &a) == KEMPE_OK);
        CHECK_NEAR(kempe_gradient_values(g)[0], 0.4 * p - 30 * x, 1e-13);
        CHECK_NEAR(kempe_gradient_values(g)[2], p * v, 1e-13);
        CHECK_NEAR(kempe_gradient_by_driven(g)[1], -30, 1e-13);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 4; k++)
                CHECK_NEAR(kempe_gradient_jacobian(g)[4 * i + k], exact[i][k], 1e-13);
    }
    kempe_gradient_free(g);
    unload(&m);
}

int main(void)
{
    TEST(a_coupler_curve);
    TEST(motion_and_reactions);
    TEST(ways_that_end);
    TEST(what_is_refused);
    TEST(states_keep_their_start);
    return check_report();
}
