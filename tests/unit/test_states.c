/* SPDX-License-Identifier: BSD-3-Clause */
/* States: the differential equations of first order that a model has of its own, on every formulation and integrator
 * against exact solutions and those of another program; events and multipliers in them; what they may not be. */
#include "base/memory.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include <kempe/table.h>

#define SLIDE "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: %s}}\n"

/* A first-order lag of 0.2 s after a step. */
#define LAG                                                                                                            \
    "kempe: 1\n"                                                                                                       \
    "parameters: {T: 0.2 s, y0: 0}\n"                                                                                  \
    "states: {y: {start: y0, rate: (1 - y)/T, scale: 1}}\n"                                                            \
    "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"

/* A direct-current motor: current, then angle and speed. */
#define MOTOR                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {R: 2, L: 5e-3, K: 0.1, b: 1e-4, U: 12}\n"                                                            \
    "states: {i: {rate: (U - R*i - K*qd(A))/L}}\n"                                                                     \
    "bodies: {rotor: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1e-3}}}\n"                     \
    "forces: {torque: {joint: A, torque: K*i - b*qd(A)}}\n"

/* A mass under a controller with an integrator. */
#define PID                                                                                                            \
    "kempe: 1\n"                                                                                                       \
    "states: {integral: {rate: 1 - q(x)}}\n"                                                                           \
    "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"                                             \
    "forces: {control: {joint: x, force: 100*(1 - q(x)) + 200*integral - 15*qd(x) - 5}}\n"

/* A cylinder that is fed through an orifice; its volume grows with the piston. */
#define SERVO                                                                                                          \
    "kempe: 1\n"                                                                                                       \
    "parameters: {beta: 1.2 GPa, area: 2e-3, load: 5 kN, damping: 1000, supply: 14 MPa}\n"                             \
    "states: {p: {start: 2.5 MPa, rate: beta/(1e-3 + area*q(x))*(2e-8*sqrt(supply - p) - area*qd(x))}}\n"              \
    "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 200}}\n"                                           \
    "forces: {piston: {joint: x, force: p*area - load - damping*qd(x)}}\n"
#define RUN "run: {t_end: %g, output_step: %g, rtol: %g, atol: %g}\n"

/* The end of a run of a model with one coordinate: q, qd and the state. */
typedef struct end {
    double q, qd, state;
} end;

/* Exact values and their sizes. Lag, motor and controller: closed forms; cylinder: collocation of order 16 with 34
 * digits, and an extrapolation of order 8. */
static const end lag_end = {0, 0, 0.9932620530009145329};
static const end motor_end = {94.7050314297303347, 116.966307224764923, 0.152129934441481524};
static const end pid_end = {1.00153311387384009, -0.00502644513188788, 0.0254710191755189266};
static const end servo_end = {0.0169045347181103873, 0.0331454164365604798, 2578314.71299143961};

static double error_at_end(const kempe_trajectory *trajectory, const end *exact, double size)
{
    int last = kempe_trajectory_row_count(trajectory) - 1;
    if (last < 0)
        return NAN;
    const double *q = kempe_trajectory_q(trajectory, last), *qd = kempe_trajectory_qd(trajectory, last);
    double of_motion = check_max(fabs(q[0] - exact->q), fabs(qd[0] - exact->qd)) / fmax(fabs(exact->qd), 1);
    return check_max(of_motion, fabs(qd[1] - exact->state) / size);
}

static double error_of(const kempe_system *system, const kmp_method *method, const end *exact, double size)
{
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {.formulation = method->formulation,
                             .form = method->form,
                             .integrator = method->integrator,
                             .no_convergence_check = 1};
    double error = kempe_simulate(system, &run, &trajectory) == KEMPE_OK ? error_at_end(trajectory, exact, size) : NAN;
    kempe_trajectory_free(trajectory);
    return error;
}

/* Every method at rtol 1e-9, relative to `size` of the state. */
static void everywhere(const char *model, double t_end, const end *exact, double size)
{
    char text[2048];
    (void)snprintf(text, sizeof text, "%s" RUN, model, t_end, t_end, 1e-9, 1e-9);
    loaded l = load_text(text);
    kmp_method method;
    int count = 0;
    double worst = 0;
    for (int k = 0; l.system && kmp_method_get(k, &method); k++, count++) {
        double error = error_of(l.system, &method, exact, size);
        worst = check_max(worst, error);
        if (!(error < 1e-5))
            printf("  %s %s %s: error %.2g\n", method.formulation, method.form ? method.form : "", method.integrator,
                   error);
        CHECK(error < 1e-5);
    }
    printf("  %d methods, largest error %.2g\n", count, worst);
    CHECK(count > 20);
    unload(&l);
}

static void lag(void)
{
    everywhere(LAG, 1, &lag_end, 1);
}

static void motor(void)
{
    everywhere(MOTOR, 1, &motor_end, 1);
}

static void controller(void)
{
    everywhere(PID, 2, &pid_end, 1);
}

static void servo(void)
{
    everywhere(SERVO, 0.5, &servo_end, 2.5e6);
}

/* Ten times the tolerance at the end of a run at 1e-11, by one-step methods of high order. */
static void digits(void)
{
    static const struct {
        const char *model;
        double t_end, size;
        const end *exact;
    } cases[] = {
        {LAG, 1, 1, &lag_end}, {MOTOR, 1, 1, &motor_end}, {PID, 2, 1, &pid_end}, {SERVO, 0.5, 2.5e6, &servo_end}};
    static const kmp_method methods[] = {{.formulation = "reduced", .form = "integrated", .integrator = "dop853"},
                                         {.formulation = "reduced", .form = "integrated", .integrator = "radau"},
                                         {.formulation = "projected", .form = "none", .integrator = "dop853"},
                                         {.formulation = "projected", .form = "none", .integrator = "radau"},
                                         {.formulation = "dae", .form = "index1", .integrator = "radau"}};
    for (int c = 0; c < 4; c++) {
        char text[2048];
        (void)snprintf(text, sizeof text, "%s" RUN, cases[c].model, cases[c].t_end, cases[c].t_end, 1e-11, 1e-11);
        loaded l = load_text(text);
        for (int k = 0; l.system && k < 5; k++) {
            double error = error_of(l.system, &methods[k], cases[c].exact, cases[c].size);
            if (!(error <= 1e-10))
                printf("  case %d, %s %s: %.2g\n", c, methods[k].formulation, methods[k].integrator, error);
            CHECK(error <= 1e-10);
        }
        unload(&l);
    }
}

/* -- stiffness --------------------------------------------------------------------------------------- */

static int pass(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                double work)
{
    double *last = user;
    (void)t, (void)qd, (void)qdd, (void)lambda, (void)work;
    *last = q[0];
    return 0;
}

/* A measured angle with a lag of a microsecond: without a given integrator the run comes to an implicit one, which
 * needs some hundred steps where an explicit one would need several hundred thousand. The log names it. */
static void stiff(void)
{
    loaded l = load_text("kempe: 1\n"
                         "states: {seen: {rate: (q(A) - seen)/1e-6, scale: 1}}\n"
                         "bodies: {arm: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n"
                         "forces: {spring: {joint: A, torque: -4*seen}}\n"
                         "start: {q: {A: 1}}\n");
    const double times[] = {1};
    double last = NAN;
    kmp_run_report report = {0};
    kmp_run_spec spec = {.formulation = "reduced", .rtol = 1e-6, .t_end = 1, .time_count = 1, .times = times};
    kmp_run_log log = {.context = l.context};
    spec.log = &log;
    CHECK(l.system && kmp_run_resolve(l.system, &spec) == KEMPE_OK);
    CHECK(l.system && kmp_run(l.system, &spec, NULL, pass, &last, &report) == KEMPE_OK);
    CHECK_TEXT(report.integrator, "radau");
    CHECK(report.steps < 2000);
    CHECK_NEAR(last, cos(2), 1e-5); /* but for the lag of a microsecond */
    kmp_free(report.reason);
    kmp_run_log_free(&log);
    unload(&l);
}

/* -- closed loops ------------------------------------------------------------------------------------ */

/* A four-bar linkage whose crank is driven by a motor; a second state measures the crank through a filter. */
#define FOUR_BAR                                                                                                       \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, -9.81, 0]\n"                                                                                         \
    "parameters: {R: 1.5, L: 0.02, K: 0.4}\n"                                                                          \
    "states:\n"                                                                                                        \
    "  i: {start: 0.5, rate: (6*sin(3*t) - R*i - K*qd(A))/L}\n"                                                        \
    "  seen: {rate: (q(A) - seen)/0.05, scale: 1}\n"                                                                   \
    "  load: {rate: 1e-3*lambda(C.1), scale: 0.1}\n"                                                                   \
    "ground: {points: {O: [0, 0, 0], D: [0.9, 0, 0]}}\n"                                                               \
    "bodies:\n"                                                                                                        \
    "  crank: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, com: [0.15, 0, 0], inertia: {zz: 0.0075},\n"      \
    "    points: {B: [0.3, 0, 0]}}\n"                                                                                  \
    "  coupler: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, com: [0.4, 0, 0], inertia: {zz: 0.053},\n"       \
    "    points: {C: [0.8, 0, 0]}}\n"                                                                                  \
    "  rocker: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, com: [0.35, 0, 0], inertia: {zz: 0.04},\n"       \
    "    points: {C: [0.7, 0, 0]}}\n"                                                                                  \
    "loops: {C: {ball: [coupler.C, rocker.C]}}\n"                                                                      \
    "forces: {motor: {joint: A, torque: K*i}}\n"                                                                       \
    "start: {q: {A: 90 deg, B: -62 deg, D: 106 deg}, hold: [A]}\n"

/* Writes the same model with the states as rates of flywheels of unit inertia, driven by torques: an independent way to
 * state it. */
static void write_flywheels(char *text, size_t size)
{
    (void)snprintf(text, size, "%s", FOUR_BAR);
    char *from = strstr(text, "states:"), *to = strstr(text, "ground:");
    memset(from, ' ', (size_t)(to - from));
    *from = '#';
    to[-1] = '\n';
    char *forces = strstr(text, "forces:");
    (void)snprintf(forces, size - (size_t)(forces - text),
                   "forces:\n  motor: {joint: A, torque: K*qd(I)}\n"
                   "  i: {joint: I, torque: (6*sin(3*t) - R*qd(I) - K*qd(A))/L}\n"
                   "  seen: {joint: S, torque: (q(A) - qd(S))/0.05}\n"
                   "  load: {joint: N, torque: 1e-3*lambda(C.1)}\n"
                   "start: {q: {A: 90 deg, B: -62 deg, D: 106 deg}, hold: [A], qd: {I: 0.5}}\n");
    char *bodies = strstr(text, "bodies:\n") + 8, rest[4096];
    (void)snprintf(rest, sizeof rest, "%s", bodies);
    int length = snprintf(bodies, size - (size_t)(bodies - text),
                          "  i: {joint: {name: I, revolute: x, at: ground}, mass: 1, inertia: {xx: 1}}\n"
                          "  seen: {joint: {name: S, revolute: x, at: ground}, mass: 1, inertia: {xx: 1}}\n"
                          "  load: {joint: {name: N, revolute: x, at: ground}, mass: 1, inertia: {xx: 1}}\n");
    (void)snprintf(bodies + length, size - (size_t)(bodies + length - text), "%s", rest);
}

/* A closed loop on every method, with multipliers in a rate, against flywheels in place of the states. */
static void closed_loop(void)
{
    static const char *const mine[] = {"A", "B", "D", "i", "seen", "load"}, *const other[] = {"A", "B", "D",
                                                                                              "I", "S", "N"};
    char text[8192];
    int place[2][6];
    kmp_method method;
    (void)snprintf(text, sizeof text, "%s" RUN, FOUR_BAR, 1.0, 1.0, 1e-9, 1e-9);
    loaded a = load_text(text);
    write_flywheels(text, sizeof text);
    size_t length = strlen(text);
    (void)snprintf(text + length, sizeof text - length, RUN, 1.0, 1.0, 1e-11, 1e-11);
    loaded b = load_text(text);
    for (int k = 0; k < 6; k++) {
        place[0][k] = coordinate_named(&a, mine[k]);
        place[1][k] = coordinate_named(&b, other[k]);
    }
    kempe_trajectory *exact = NULL;
    kempe_run_options tight = {.formulation = "reduced", .integrator = "dop853", .no_convergence_check = 1};
    CHECK(b.system && kempe_simulate(b.system, &tight, &exact) == KEMPE_OK);
    const double *want = kempe_trajectory_qd(exact, 1);
    for (int i = 0; a.system && want && kmp_method_get(i, &method); i++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options run = {.formulation = method.formulation,
                                 .form = method.form,
                                 .integrator = method.integrator,
                                 .no_convergence_check = 1};
        bool teaching = method.form && (strcmp(method.form, "index3") == 0 || strcmp(method.form, "index2") == 0);
        kempe_status status = kempe_simulate(a.system, &run, &trajectory);
        const double *qd = kempe_trajectory_qd(trajectory, kempe_trajectory_row_count(trajectory) - 1);
        if (!teaching && status != KEMPE_OK)
            printf("  %s %s %s: %s\n", method.formulation, method.form ? method.form : "", method.integrator,
                   kempe_context_message(a.context));
        CHECK(teaching || status == KEMPE_OK);
        for (int k = 0; status == KEMPE_OK && k < 6; k++) {
            double error = fabs(qd[place[0][k]] - want[place[1][k]]), allowed = teaching ? 1e-2 : 2e-5;
            if (!(error < allowed))
                printf("  %s %s %s, %s: %.2g\n", method.formulation, method.form ? method.form : "", method.integrator,
                       mine[k], error);
            CHECK(error < allowed);
        }
        kempe_trajectory_free(trajectory);
    }
    kempe_trajectory_free(exact);
    unload(&a);
    unload(&b);
}

/* -- events ------------------------------------------------------------------------------------------ */

/* A lag charges to 0.5, then discharges: the condition changes at T ln 2, where the run of `until` ends. */
static void events(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, "%srun: {t_end: 1, rtol: 1e-11, until: y > 0.5}\n", LAG);
    loaded l = load_text(text);
    kempe_trajectory *trajectory = NULL;
    (void)kempe_simulate(l.system, NULL, &trajectory);
    int last = kempe_trajectory_row_count(trajectory) - 1;
    CHECK_NEAR(kempe_trajectory_time(trajectory, last), 0.2 * log(2), 1e-11);
    CHECK_NEAR(kempe_trajectory_qd(trajectory, last)[1], 0.5, 1e-11);
    kempe_trajectory_free(trajectory);
    unload(&l);
    /* m v' = 1 while y < 1/2 */
    (void)snprintf(text, sizeof text,
                   "%sforces: {push: {joint: x, force: \"if(y < 0.5, 1, 0)\"}}\nrun: {t_end: 1, rtol: 1e-11}\n", LAG);
    l = load_text(text);
    CHECK(l.system && kempe_simulate(l.system, NULL, &trajectory) == KEMPE_OK);
    last = kempe_trajectory_row_count(trajectory) - 1;
    CHECK_NEAR(kempe_trajectory_qd(trajectory, last)[0], 0.2 * log(2), 1e-10);
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* -- transfer functions ------------------------------------------------------------------------------ */

/* Step responses: 2/(0.5 s + 1); s/(s^2 + 2 s + 2) is e^-t sin t; (s + 3)/(s^3 + 3 s^2 + 2 s) is
 * 3/2 t - 7/4 + 2 e^-t - 1/4 e^-2t; and one that filters the motion. */
static void transfer_functions(void)
{
    loaded l =
        load_text("kempe: 1\nparameters: {T: 0.5 s}\nstates:\n"
                  "  lag: {transfer: 1, numerator: [2], denominator: [T, 1]}\n"
                  "  wave: {transfer: 1, numerator: [1, 0], denominator: [1, 2, 2]}\n"
                  "  long: {transfer: 1, numerator: [2, 6], denominator: [2, 6, 4, 0]}\n"
                  "  seen: {start: 1, transfer: qd(x), numerator: [3], denominator: [1, 3]}\n"
                  "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                  "forces: {f: {joint: x, force: 2}}\n"
                  "run: {t_end: 3, output_step: 0.5, rtol: 1e-11, atol: 1e-11, outputs: [lag, wave, long, seen]}\n");
    kempe_trajectory *trajectory = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_simulate(l.system, NULL, &trajectory) == KEMPE_OK);
    CHECK(trajectory && kempe_trajectory_table(trajectory, "rows", &table) == KEMPE_OK);
    for (int k = 0; k < kempe_table_row_count(table); k++) {
        double t = 0.5 * k;
        CHECK_NEAR(kempe_table_number(table, k, 1), 2 * (1 - exp(-2 * t)), 1e-9);
        CHECK_NEAR(kempe_table_number(table, k, 2), exp(-t) * sin(t), 1e-9);
        CHECK_NEAR(kempe_table_number(table, k, 3), 1.5 * t - 1.75 + 2 * exp(-t) - 0.25 * exp(-2 * t), 1e-9);
        CHECK_NEAR(kempe_table_number(table, k, 4), 2 * t - 2.0 / 3 + 5.0 / 3 * exp(-3 * t), 1e-9);
    }
    CHECK(kempe_table_row_count(table) == 7);
    kempe_table_free(table);
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* -- dry friction ------------------------------------------------------------------------------------ */

/* A brake holds a motor, whose current rises, while nothing can move: it slips where K i reaches its level, at half the
 * final current, after L/R ln 2. */
static void held_motor(void)
{
    loaded l = load_text("kempe: 1\nparameters: {R: 2, L: 5e-3, K: 0.1, U: 12}\n"
                         "states: {i: {rate: (U - R*i - K*qd(A))/L, scale: 1}}\n"
                         "bodies: {rotor: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1e-3}}}\n"
                         "forces: {torque: {joint: A, torque: K*i}, brake: {joint: A, friction: {torque: 0.3}}}\n"
                         "run: {t_end: 0.01, rtol: 1e-10, atol: 1e-10, until: qd(A) > 1e-9}\n");
    static const char *const formulations[] = {"reduced", "projected", "dae"};
    for (int k = 0; k < 3; k++) {
        kempe_trajectory *trajectory = NULL;
        kempe_run_options run = {.formulation = formulations[k],
                                 .integrator = independent_integrator(formulations[k]),
                                 .no_convergence_check = 1};
        (void)kempe_simulate(l.system, &run, &trajectory);
        int last = kempe_trajectory_row_count(trajectory) - 1;
        CHECK(last > 0);
        CHECK_NEAR(kempe_trajectory_time(trajectory, last), 2.5e-3 * log(2), 1e-6);
        kempe_trajectory_free(trajectory);
    }
    unload(&l);
}

/* -- results ----------------------------------------------------------------------------------------- */

/* Columns of states, alone and with all; the integral of a state is shown nowhere, and it has no energy. */
static void columns(void)
{
    char text[1024];
    (void)snprintf(text, sizeof text, "%srun: {t_end: 1, output_step: 0.5, outputs: [q, qd, qdd, state, energy]}\n",
                   LAG);
    loaded l = load_text(text);
    kempe_trajectory *trajectory = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_simulate(l.system, NULL, &trajectory) == KEMPE_OK);
    CHECK(trajectory && kempe_trajectory_table(trajectory, "rows", &table) == KEMPE_OK);
    static const char *const wanted[] = {
        "t", "q.x", "qd.x", "qdd.x", "state.y", "energy.kinetic", "energy.potential", "energy.total"};
    CHECK(kempe_table_column_count(table) == 8);
    for (int k = 0; table && k < 8; k++)
        CHECK_TEXT(kempe_table_column_name(table, k), wanted[k]);
    CHECK_NEAR(kempe_table_number(table, 2, 4), lag_end.state, 1e-7);
    CHECK(kempe_table_number(table, 2, 7) == 0);
    kempe_table_free(table);
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* A constant rate, a start by a parameter, and a start that is set from outside. */
static void starts(void)
{
    static const kempe_setting set[] = {{"y0", "0.25"}};
    char text[1024];
    (void)snprintf(text, sizeof text, "%srun: {t_end: 1, rtol: 1e-11}\n", LAG);
    loaded l = {.context = kempe_context_new()};
    (void)kempe_model_read_text_set(l.context, text, "model.yaml", set, 1, &l.model);
    l = load_finish(l);
    kempe_trajectory *trajectory = NULL;
    CHECK(l.system && kempe_simulate(l.system, NULL, &trajectory) == KEMPE_OK);
    const double *qd = kempe_trajectory_qd(trajectory, kempe_trajectory_row_count(trajectory) - 1);
    CHECK_NEAR(qd ? qd[1] : NAN, 1 - 0.75 * exp(-5), 1e-10);
    kempe_trajectory_free(trajectory);
    unload(&l);
    (void)snprintf(text, sizeof text, "kempe: 1\nstates: {v: {start: 1, rate: 3}}\n" SLIDE "run: {t_end: 2}\n", "1");
    l = load_text(text);
    CHECK(l.system && kempe_simulate(l.system, NULL, &trajectory) == KEMPE_OK);
    qd = kempe_trajectory_qd(trajectory, kempe_trajectory_row_count(trajectory) - 1);
    CHECK_NEAR(qd ? qd[1] : NAN, 7, 1e-10);
    kempe_trajectory_free(trajectory);
    unload(&l);
}

/* -- mistakes ---------------------------------------------------------------------------------------- */

/* The one error of a model with these sections. */
static void refused(const char *sections, const char *sentence)
{
    char text[1024];
    (void)snprintf(text, sizeof text, "kempe: 1\n%s\n" SLIDE, sections, "1");
    load_rejected(text, sentence);
}

static void mistakes(void)
{
    refused("states: {y: {start: 1}}", "state 'y' has no key 'rate'");
    refused("states: {y: {transfer: 1, numerator: [1, 2, 3], denominator: [1, 2]}}",
            "at least the degree of its numerator");
    refused("states: {y: {transfer: 1, numerator: [1], denominator: [0, 2]}}",
            "a leading coefficient that is not zero");
    refused("states: {y: {transfer: 1, numerator: [1]}}", "state 'y' has no key 'denominator'");
    refused("states: {y: {transfer: 1, rate: 1}}", "exactly one of");
    refused("states: {sin: {rate: 1}}", "a state cannot have the name 'sin'");
    refused("states: {x: {rate: 1}}", "a state cannot have the name 'x', which a coordinate has");
    refused("states: {y: {rate: 1, scale: -1}}", "scale of state 'y' is -1: it must be positive");
    refused("states: {y: {rate: z}}", "unknown");
    refused("states: {y: {rate: 1, start: y}}", "state 'y' is not allowed here: a constant is expected");
    refused("states: {y: {rate: 1}}\nforces: {f: {joint: x, force: y(1)}}", "'y' is a state, not a function");
    refused("states: {y: {rate: 1}}\nloops: {c: {constraint: q(x) - y}}",
            "a constraint may depend on t, q(..) and positions, not on state 'y'");
    refused("states: {y: {rate: 1}}\ndrives: {d: {joint: x, displacement: y}}",
            "state 'y' is not allowed here: a function of t is expected");
    refused("states: {y: {rate: q(y)}}", "'y'");
}

int main(void)
{
    TEST(lag);
    TEST(motor);
    TEST(controller);
    TEST(servo);
    TEST(digits);
    TEST(stiff);
    TEST(closed_loop);
    TEST(events);
    TEST(transfer_functions);
    TEST(held_motor);
    TEST(columns);
    TEST(starts);
    TEST(mistakes);
    return check_report();
}
