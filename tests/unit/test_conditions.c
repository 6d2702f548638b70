/* SPDX-License-Identifier: BSD-3-Clause */
/* Conditions of elements: the same one in every graph, an input during steps and a comparison elsewhere. Closures that
 * switch: rates jump as in a plastic impact. Conditions that end a run, of the state and of multipliers. All against
 * closed forms, on every formulation. */
#include "base/memory.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "model/data/force.h"
#include "testing.h"
#include <kempe/stepper.h>

/* A graph of the model with its events, as programs are derived from. */
static kmp_equations derive(const loaded *s, kmp_events *events)
{
    kmp_equations eq;
    const kmp_derivation_request scene = {.sets = KMP_SET_BIAS, .events = events};
    CHECK(kmp_equations_derive(&eq, s->model, &scene) == KEMPE_OK);
    return eq;
}

static kmp_ref coordinate(const kmp_equations *eq, int k)
{
    return kmp_input(eq->graph, KMP_IN_Q, (uint32_t)k);
}

static kmp_ref options(const kmp_equations *eq, const void *of, int number, kmp_ref difference)
{
    return kmp_tree_condition(&eq->tree, of, number, difference, 0, NULL, "stop '%s': contact %d", "S", number + 1);
}

static void each_graph_has_the_same(void)
{
    loaded s = load("tests/models/bounce.yaml");
    kmp_events events = {0};
    kmp_equations a = derive(&s, &events), b = derive(&s, &events);
    const kmp_force *force = kmp_model_force(s.model, 0);
    kmp_ref one = KMP_ONE, difference;
    int first = events.count; /* the model's own condition */
    CHECK(first == 1);
    kmp_ref x = options(&a, force, 0, coordinate(&a, 0)),
            y = options(&a, force, 1, kmp_add(a.graph, coordinate(&a, 0), one));
    CHECK(x == kmp_input(a.graph, KMP_IN_MODE, (uint32_t)first));
    CHECK(y == kmp_input(a.graph, KMP_IN_MODE, (uint32_t)first + 1));
    CHECK(options(&a, force, 0, coordinate(&a, 0)) == x && events.count == first + 2);
    CHECK(options(&a, s.model, 0, coordinate(&a, 0)) != x && events.count == first + 3);
    CHECK(strcmp(events.condition[first + 1].text, "stop 'S': contact 2") == 0);
    CHECK(!kmp_tree_event(&b.tree, first, &difference));
    CHECK(options(&b, force, 1, kmp_neg(coordinate(&b, 0))) == kmp_input(b.graph, KMP_IN_MODE, (uint32_t)first + 1));
    CHECK(kmp_tree_event(&b.tree, first + 1, &difference) && difference == kmp_neg(coordinate(&b, 0)));
    CHECK(!kmp_tree_event(&b.tree, first, &difference));
    CHECK(kmp_tree_event(&a.tree, first, &difference) && difference == coordinate(&a, 0));
    CHECK(kmp_tree_event(&a.tree, 0, &difference)); /* an expression's is derived anywhere */
    CHECK(kmp_tree_event(&b.tree, 0, &difference));
    kmp_equations_free(&a);
    kmp_equations_free(&b);
    kmp_events_free(&events);
    unload(&s);
}

static void what_stands_still_is_compared(void)
{
    loaded s = load("tests/models/bounce.yaml");
    kmp_events events = {0};
    kmp_equations a = derive(&s, &events), b = derive(&s, NULL);
    int count = events.count;
    CHECK(options(&a, &s, 0, KMP_ONE) == KMP_ZERO && options(&a, &s, 1, kmp_neg(KMP_ONE)) == KMP_ONE);
    CHECK(events.count == count);
    kmp_ref q = coordinate(&b, 0);
    CHECK(options(&b, &s, 0, q) == kmp_less(b.graph, q, KMP_ZERO));
    kmp_equations_free(&a);
    kmp_equations_free(&b);
    kmp_events_free(&events);
    unload(&s);
}

/* -- runs -------------------------------------------------------------------------------------------- */

typedef struct last {
    int n, m;
    double t, q[4], qd[4], lambda[4], work;
    int rows;
} last;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    last *l = user;
    (void)qdd;
    l->rows++;
    l->t = t;
    l->work = work;
    memcpy(l->q, q, (size_t)l->n * sizeof *q);
    memcpy(l->qd, qd, (size_t)l->n * sizeof *qd);
    memcpy(l->lambda, lambda, (size_t)l->m * sizeof *lambda);
    return 0;
}

/* Every hundredth of a second; the report's reason is freed with `check`, which it has to contain. */
static kmp_run_report run(const loaded *s, const kmp_method *method, double t_end, kempe_status expected,
                          const char *reason, last *l)
{
    enum { MOST = 301 };
    double times[MOST];
    kmp_run_report report;
    kmp_run_spec spec = {.formulation = method->formulation,
                         .form = method->form,
                         .integrator = method->integrator,
                         .rtol = 1e-9,
                         .t_end = t_end,
                         .times = times,
                         .time_count = (int)lround(100 * t_end) + 1};
    *l = (last){.n = s->system->n, .m = s->system->m};
    for (int k = 0; k < spec.time_count; k++)
        times[k] = t_end * k / (spec.time_count - 1);
    CHECK(kmp_run_resolve(s->system, &spec) == KEMPE_OK);
    kempe_status status = kmp_run(s->system, &spec, NULL, take_row, l, &report);
    bool said = reason ? report.reason && strstr(report.reason, reason) : !report.reason;
    if (status != expected || !said)
        printf("  %s %s %s: %d, %s\n", method->formulation, method->form, method->integrator, (int)status,
               report.reason ? report.reason : kempe_context_message(s->context));
    CHECK(status == expected && said);
    kmp_free(report.reason);
    return report;
}

/* Forms for teaching lose most digits of accelerations. */
static bool is_exact(const kmp_method *method)
{
    return strcmp(method->formulation, "dae") != 0 || strcmp(method->form, "stabilized1") == 0;
}

/* A bead slides onto a ramp of slope s: its rate (v, 0) becomes v / (1 + s^2) (1, s). It climbs, comes back and stays
 * on the floor, at the second jump with (w, s w) -> (w, 0): each time what is lost is half the square of what is taken.
 */
static void rates_jump_as_in_a_plastic_impact(void)
{
    const double g = 9.81, slope = 0.5, v = 3, share = 1 + slope * slope, m = 2;
    double a = g * slope / share, up = v / share, t = 1.0 / 3 + 2 * up / a;
    double lost = 0.5 * m * (v * v - share * up * up) + 0.5 * m * slope * slope * up * up;
    loaded s = load("tests/models/ramp.yaml");
    kmp_method method;
    CHECK(s.system->switches && s.system->dissipative);
    for (int k = 0; kmp_method_get(k, &method); k++) {
        last l;
        if (!is_exact(&method))
            continue;
        kmp_run_report report = run(&s, &method, 2, KEMPE_OK, NULL, &l);
        CHECK(report.events == 2 && l.rows == 201);
        CHECK_NEAR(l.q[0], -up * (2 - t), 1e-6);
        CHECK_NEAR(l.qd[0], -up, 1e-6);
        CHECK_NEAR(l.q[1], 0, 1e-7);
        CHECK_NEAR(l.qd[1], 0, 1e-7);
        CHECK_NEAR(l.work, -lost, 1e-6);
    }
    unload(&s);
}

/* A bead leaves a round hill of radius 1 at the height (2 + v^2 / g) / 3, where the normal force is zero. */
static void a_run_ends_where_a_multiplier_says_so(void)
{
    loaded s = load("tests/models/hill.yaml");
    kmp_method method;
    for (int k = 0; kmp_method_get(k, &method); k++) {
        last l;
        if (!is_exact(&method))
            continue;
        kmp_run_report report =
            run(&s, &method, 3, KEMPE_STOPPED, "the run ends as requested: lambda(track.1) < 0 at t = 0.7542388", &l);
        CHECK(report.ended && report.t == l.t && report.events == 0);
        CHECK_NEAR(l.q[1], (2 + 0.25 / 9.81) / 3, 1e-7);
        CHECK_NEAR(l.lambda[0], 0, 1e-9);
        CHECK(l.rows == 77); /* 0 .. 0.75, and where it ends */
    }
    unload(&s);
}

static const char *const falls = "kempe: 1\ngravity: [0, -9.81, 0]\n"
                                 "bodies: {ball: {joint: {name: S, prismatic: y, at: ground}, mass: 2}}\n"
                                 "start: {q: {S: %s}}\n"
                                 "run: {t_end: 1, rtol: 1e-9, until: [\"t > 0.9\", \"%s\"]}\n";

static loaded falling(const char *from, const char *until)
{
    char text[512];
    (void)snprintf(text, sizeof text, falls, from, until);
    return load_text(text);
}

static void the_first_of_several_ends_it(void)
{
    const kmp_method method = {.formulation = "reduced", .form = "integrated", .integrator = "dop853"};
    last l;
    loaded s = falling("0.5", "q(S) <= 0");
    (void)run(&s, &method, 1, KEMPE_STOPPED, "q(S) <= 0 at t = 0.319275428 s", &l);
    CHECK_NEAR(l.t, sqrt(2 * 0.5 / 9.81), 1e-9);
    CHECK_NEAR(l.q[0], 0, 1e-12);
    unload(&s);
    s = falling("10", "q(S) <= 0");
    (void)run(&s, &method, 1, KEMPE_STOPPED, "t > 0.9 at t = 0.9 s", &l);
    CHECK(l.rows == 91 || l.rows == 92);
    unload(&s);
    s = falling("10", "2*q(S) < qd(S)");
    (void)run(&s, &method, 0.5, KEMPE_OK, NULL, &l);
    unload(&s);
}

/* The row of the start is there, and no step is made. */
static void what_holds_at_the_start_ends_it_there(void)
{
    const kmp_method method = {.formulation = "projected", .form = NULL, .integrator = "dop853"};
    last l;
    loaded s = falling("-0.5", "q(S) < 0");
    kmp_run_report report = run(&s, &method, 1, KEMPE_STOPPED, "q(S) < 0 at t = 0 s", &l);
    CHECK(report.steps == 0 && report.ended && l.rows == 1 && l.t == 0);
    unload(&s);
}

static void a_stepper_stands_there(void)
{
    loaded s = falling("0.5", "q(S) < 0");
    kempe_stepper *stepper = NULL;
    const kempe_run_options options = {0};
    CHECK(kempe_stepper_new(s.system, &options, &stepper) == KEMPE_OK);
    CHECK(kempe_stepper_advance(stepper, 0.3) == KEMPE_OK);
    CHECK(kempe_stepper_advance(stepper, 0.8) == KEMPE_STOPPED);
    CHECK_NEAR(kempe_stepper_time(stepper), sqrt(2 * 0.5 / 9.81), 1e-8);
    CHECK_NEAR(kempe_stepper_q(stepper)[0], 0, 1e-9);
    CHECK(strstr(kempe_stepper_reason(stepper), "q(S) < 0 at t = ") != NULL);
    CHECK(kempe_stepper_step(stepper) == KEMPE_STOPPED);
    kempe_stepper_free(stepper);
    unload(&s);
}

int main(void)
{
    TEST(each_graph_has_the_same);
    TEST(what_stands_still_is_compared);
    TEST(rates_jump_as_in_a_plastic_impact);
    TEST(a_run_ends_where_a_multiplier_says_so);
    TEST(the_first_of_several_ends_it);
    TEST(what_holds_at_the_start_ends_it_there);
    TEST(a_stepper_stands_there);
    return check_report();
}
