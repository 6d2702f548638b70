/* SPDX-License-Identifier: BSD-3-Clause */
/* A run under the caller's control is the run that kempe_simulate makes. */
#include "four_bar.h"
#include "loaded.h"
#include <kempe/build.h>
#include <kempe/extend.h>
#include <kempe/stepper.h>

enum { N = 3, M = 2, ROWS = 40 };

static loaded four_bar(void)
{
    loaded s = {.context = kempe_context_new()};
    s.model = four_bar_new(s.context, FOUR_BAR_TORQUE);
    return load_finish(s);
}

static kempe_run_options settings(const char *formulation, const char *integrator)
{
    kempe_run_options run = {0};
    run.formulation = formulation;
    run.integrator = integrator;
    run.rtol = 1e-8;
    run.t_end = 1;
    return run;
}

/* The same run by kempe_simulate, with a row for each time at which the steppers are compared. */
static kempe_status simulate_rows(const kempe_system *system, kempe_run_options run, kempe_trajectory **trajectory)
{
    run.output_step = 1.0 / ROWS;
    return kempe_simulate(system, &run, trajectory);
}

static void check_row(const kempe_stepper *stepper, const kempe_trajectory *trajectory, int row)
{
    const double *want[4] = {kempe_trajectory_q(trajectory, row), kempe_trajectory_qd(trajectory, row),
                             kempe_trajectory_qdd(trajectory, row), kempe_trajectory_lambda(trajectory, row)};
    const double *have[4] = {kempe_stepper_q(stepper), kempe_stepper_qd(stepper), kempe_stepper_qdd(stepper),
                             kempe_stepper_lambda(stepper)};
    for (int k = 0; k < 4; k++)
        CHECK(memcmp(have[k], want[k], (k < 3 ? N : M) * sizeof(double)) == 0);
}

static void same_as_simulate(const char *formulation, const char *integrator)
{
    loaded s = four_bar();
    kempe_trajectory *trajectory = NULL;
    kempe_stepper *stepper = NULL;
    kempe_run_options run = settings(formulation, integrator);
    CHECK(simulate_rows(s.system, run, &trajectory) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    CHECK(kempe_trajectory_row_count(trajectory) == ROWS + 1);
    for (int k = 0; k <= ROWS && stepper; k++) {
        double t = kempe_trajectory_time(trajectory, k);
        CHECK(kempe_stepper_advance(stepper, t) == KEMPE_OK);
        CHECK(kempe_stepper_time(stepper) == t);
        check_row(stepper, trajectory, k);
    }
    CHECK(kempe_stepper_work(stepper).steps > 10 && kempe_stepper_work(stepper).rhs > 100);
    CHECK_TEXT(kempe_stepper_reason(stepper), "");
    kempe_stepper_free(stepper);
    kempe_trajectory_free(trajectory);
    unload(&s);
}

static void reduced(void)
{
    same_as_simulate("reduced", NULL);
}

static void projected(void)
{
    same_as_simulate("projected", NULL);
}

static void dae(void)
{
    same_as_simulate("dae", NULL);
    same_as_simulate("dae", "ida");
}

/* Steps end where the integrator's do, whatever is looked at between. */
static void single_steps(void)
{
    loaded s = four_bar();
    kempe_stepper *a = NULL, *b = NULL;
    kempe_run_options run = settings(NULL, NULL);
    int steps = 0;
    CHECK(kempe_stepper_new(s.system, &run, &a) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &run, &b) == KEMPE_OK);
    while (kempe_stepper_time(a) < run.t_end && steps < 10000) {
        double t = kempe_stepper_time(a);
        CHECK(kempe_stepper_step(a) == KEMPE_OK);
        CHECK(kempe_stepper_time(a) > t);
        CHECK(kempe_stepper_advance(b, t + 0.3 * (kempe_stepper_time(a) - t)) == KEMPE_OK);
        CHECK(kempe_stepper_step(b) == KEMPE_OK);
        CHECK(kempe_stepper_time(a) == kempe_stepper_time(b));
        CHECK(memcmp(kempe_stepper_q(a), kempe_stepper_q(b), N * sizeof(double)) == 0);
        steps++;
    }
    CHECK(kempe_stepper_work(a).steps == steps);
    CHECK(kempe_stepper_step(a) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_advance(a, 0.5) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_advance(a, 2) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_advance(a, NAN) == KEMPE_E_ARGUMENT);
    CHECK(kempe_stepper_time(a) == run.t_end);
    kempe_stepper_free(a);
    kempe_stepper_free(b);
    unload(&s);
}

/* Each call has its own reason: none after a success, another one after another failure. */
static void reasons_are_of_the_last_call(void)
{
    loaded s = four_bar();
    kempe_stepper *stepper = NULL;
    kempe_run_options run = settings("projected", NULL);
    double q[N], slow[N], fast[N];
    char first[200];
    run.t_end = 10;
    run.max_steps = 60;
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    for (int i = 0; stepper && i < N; i++) {
        q[i] = kempe_stepper_q(stepper)[i];
        slow[i] = 2 * kempe_stepper_qd(stepper)[i];
        fast[i] = 10 * slow[i];
    }
    CHECK(kempe_stepper_set_state(stepper, q, slow, NULL) == KEMPE_OK);
    CHECK(kempe_stepper_advance(stepper, 9) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_stepper_reason(stepper), "limit of 60 steps") != NULL);
    (void)snprintf(first, sizeof first, "%s", kempe_stepper_reason(stepper));
    CHECK(kempe_stepper_reset(stepper) == KEMPE_OK);
    CHECK_TEXT(kempe_stepper_reason(stepper), "");
    CHECK(kempe_stepper_set_state(stepper, q, fast, NULL) == KEMPE_OK);
    CHECK(kempe_stepper_advance(stepper, 9) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_stepper_reason(stepper), "limit of 60 steps") != NULL);
    CHECK(strcmp(kempe_stepper_reason(stepper), first) != 0);
    CHECK(strstr(kempe_context_message(s.context), kempe_stepper_reason(stepper)) != NULL);
    CHECK(kempe_stepper_reset(stepper) == KEMPE_OK && kempe_stepper_advance(stepper, 0.01) == KEMPE_OK);
    CHECK_TEXT(kempe_stepper_reason(stepper), "");
    kempe_stepper_free(stepper);
    unload(&s);
}

static kempe_stepper *inner;
static int refusals;

/* A force function that moves the stepper which calls it. */
static int meddle(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)user, (void)t, (void)q, (void)qd, (void)effort;
    refusals += inner && kempe_stepper_step(inner) == KEMPE_E_ARGUMENT && kempe_stepper_reset(inner) < 0;
    return 0;
}

static void steps_inside_a_step(void)
{
    loaded s = four_bar();
    kempe_stepper *stepper = NULL;
    kempe_run_options run = settings(NULL, NULL);
    kempe_system_set_force(s.system, meddle, NULL);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    inner = stepper;
    refusals = 0;
    (void)kempe_stepper_advance(stepper, 0.1);
    CHECK(refusals > 0);
    inner = NULL;
    kempe_stepper_free(stepper);
    unload(&s);
}

/* The texts of the options may be gone after the call: they are read when the stepper makes a run again. */
static void options_that_are_gone(void)
{
    loaded s = four_bar();
    kempe_stepper *stepper = NULL, *other = NULL, *copy = NULL;
    char formulation[] = "dae", form[] = "stabilized1", integrator[] = "ida", linear[] = "klu", backend[] = "tape",
         points[] = "ignore", independent[] = "A";
    char *const text[] = {formulation, form, integrator, linear, backend, points, independent};
    kempe_run_options run = settings(formulation, integrator), kept = settings("dae", "ida");
    run.form = form;
    run.linear = linear;
    run.backend = backend;
    run.change_points = points;
    run.independent = independent;
    kept.form = "stabilized1";
    kept.linear = "klu";
    kept.backend = "tape";
    kept.change_points = "ignore";
    kept.independent = "A";
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    CHECK(kempe_stepper_new(s.system, &kept, &other) == KEMPE_OK);
    for (size_t k = 0; k < sizeof text / sizeof *text; k++)
        memset(text[k], '?', strlen(text[k]));
    memset(&run, '?', sizeof run);
    kempe_stepper *const all[] = {stepper, other};
    for (int k = 0; k < 2; k++) {
        CHECK(kempe_stepper_advance(all[k], 0.3) == KEMPE_OK);
        CHECK(kempe_stepper_reset(all[k]) == KEMPE_OK);
        CHECK(kempe_stepper_advance(all[k], 0.4) == KEMPE_OK);
    }
    CHECK(memcmp(kempe_stepper_q(stepper), kempe_stepper_q(other), N * sizeof(double)) == 0);
    CHECK(kempe_stepper_copy(stepper, &copy) == KEMPE_OK);
    kempe_stepper_free(stepper);
    CHECK(kempe_stepper_reset(copy) == KEMPE_OK && kempe_stepper_advance(copy, 0.4) == KEMPE_OK);
    CHECK(memcmp(kempe_stepper_q(copy), kempe_stepper_q(other), N * sizeof(double)) == 0);
    kempe_stepper_free(copy);
    kempe_stepper_free(other);
    unload(&s);
}

static void refused(void)
{
    loaded s = four_bar();
    kempe_stepper *stepper = NULL;
    kempe_run_options run = settings("reducd", NULL);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_E_ARGUMENT && !stepper);
    CHECK(strlen(kempe_context_message(s.context)) > 0);
    unload(&s);
}

static void interrupted(void)
{
    loaded s = four_bar();
    kempe_stepper *stepper = NULL;
    kempe_run_options run = settings(NULL, NULL);
    CHECK(kempe_stepper_new(s.system, &run, &stepper) == KEMPE_OK);
    kempe_context_interrupt(s.context);
    CHECK(kempe_stepper_step(stepper) == KEMPE_STOPPED);
    CHECK_TEXT(kempe_stepper_reason(stepper), "interrupted");
    CHECK(kempe_stepper_time(stepper) > 0);
    kempe_stepper_free(stepper);
    unload(&s);
}

/* -- inputs ------------------------------------------------------------------------------------------ */

typedef struct formulation_name {
    const char *formulation, *form, *integrator;
} formulation_name;

static const formulation_name formulations[] = {
    {"reduced", "integrated", "dop853"}, {"reduced", "integrated", "dopri5"}, {"reduced", "integrated", "erk"},
    {"reduced", "newton", "adams"},      {"reduced", "newton", "bdf"},        {"reduced", "newton", "dirk"},
    {"reduced", "newton", "radau5"},     {"reduced", "newton", "radau9"},     {"projected", NULL, "dop853"},
    {"dae", "stabilized1", "ida"},       {"projected", NULL, "radau"},        {"reduced", "integrated", "radau"},
};
enum { FORMULATIONS = sizeof formulations / sizeof *formulations };

static int push(void *user, double t, const double *q, const double *qd, double *effort)
{
    (void)t, (void)q, (void)qd;
    effort[0] += *(const double *)user;
    return 0;
}

static kempe_run_options settings_of(const formulation_name *way, double t_end)
{
    kempe_run_options run = settings(way->formulation, way->integrator);
    run.form = way->form;
    run.t_end = t_end;
    return run;
}

static kempe_model *wheel_new(kempe_context *context)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_new(context, "wheel", &model) == KEMPE_OK);
    kempe_body_def body = kempe_body_default("wheel");
    body.joint = "A";
    body.at = "ground";
    body.mass = kempe_value(1);
    body.inertia[2] = kempe_value(1);
    CHECK(kempe_model_add_body(model, &body) == KEMPE_OK);
    CHECK(kempe_model_finish(model) == KEMPE_OK);
    return model;
}

/* 1 N m from 1 s to 2 s on an inertia of 1 kg m2, at rest before: 1 rad/s from there on. */
static void sampled_torque(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = wheel_new(context);
    kempe_system *system = NULL;
    double torque = 0;
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    kempe_system_set_force(system, push, &torque);
    for (int w = 0; w < FORMULATIONS; w++) {
        kempe_stepper *stepper = NULL;
        kempe_run_options run = settings_of(&formulations[w], 4);
        torque = 0;
        CHECK(kempe_stepper_new(system, &run, &stepper) == KEMPE_OK);
        double error = stepper ? 0 : INFINITY;
        for (int k = 1; k <= 80 && stepper; k++) {
            double t = 0.05 * k;
            torque = k > 20 && k <= 40 ? 1 : 0;
            CHECK(kempe_stepper_advance(stepper, t) == KEMPE_OK);
            error = fmax(error, fabs(kempe_stepper_qd(stepper)[0] - fmin(fmax(t - 1, 0), 1)));
        }
        printf("  %-9s %-8s %-7s error %.1e\n", formulations[w].formulation,
               formulations[w].form ? formulations[w].form : "", formulations[w].integrator, error);
        CHECK(error < 1e-6);
        kempe_stepper_free(stepper);
    }
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* The largest difference of q between a run by the model and rows; those of a stepper whose input is the torque, at the
 * same times. */
static double off_by_model(const kempe_system *system, const kempe_run_options *run, const kempe_trajectory *exact)
{
    kempe_trajectory *trajectory = NULL;
    double error = 0;
    CHECK(simulate_rows(system, *run, &trajectory) == KEMPE_OK);
    for (int k = 0; k <= ROWS && trajectory; k++)
        for (int i = 0; i < N; i++)
            error = fmax(error, fabs(kempe_trajectory_q(trajectory, k)[i] - kempe_trajectory_q(exact, k)[i]));
    kempe_trajectory_free(trajectory);
    return error;
}

static double off_by_input(const kempe_system *system, const kempe_run_options *run, const kempe_trajectory *exact,
                           double *torque)
{
    static const double value[4] = {0.2, 5, -3, -3};
    kempe_stepper *stepper = NULL;
    double error = 0;
    *torque = value[0];
    CHECK(kempe_stepper_new(system, run, &stepper) == KEMPE_OK);
    for (int k = 1; k <= ROWS && stepper; k++) {
        *torque = value[4 * (k - 1) / ROWS];
        CHECK(kempe_stepper_advance(stepper, kempe_trajectory_time(exact, k)) == KEMPE_OK);
        for (int i = 0; i < N; i++)
            error = fmax(error, fabs(kempe_stepper_q(stepper)[i] - kempe_trajectory_q(exact, k)[i]));
    }
    kempe_stepper_free(stepper);
    return error;
}

/* The torque of the four-bar in three parts, by conditions of the model and by inputs: on every formulation the same
 * motion, to a few times the error of that formulation. Multistep methods err more, for each call they begin at order
 * one. */
static void sampled_torque_on_a_loop(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *said = four_bar_new(context, "if(t < 0.25, 0.2, if(t < 0.5, 5, -3))");
    kempe_model *bare = four_bar_new(context, NULL);
    kempe_system *by_model = NULL, *by_input = NULL;
    double torque = 0;
    CHECK(kempe_system_new(said, &by_model) == KEMPE_OK && kempe_system_new(bare, &by_input) == KEMPE_OK);
    kempe_system_set_force(by_input, push, &torque);
    kempe_run_options run = settings_of(&formulations[0], 1);
    kempe_trajectory *exact = NULL;
    run.rtol = 1e-12;
    CHECK(simulate_rows(by_model, run, &exact) == KEMPE_OK);
    for (int w = 0; w < FORMULATIONS && exact; w++) {
        run = settings_of(&formulations[w], 1);
        double model = off_by_model(by_model, &run, exact), input = off_by_input(by_input, &run, exact, &torque);
        printf("  %-9s %-8s %-7s error by the model %.1e, by inputs %.1e\n", formulations[w].formulation,
               formulations[w].form ? formulations[w].form : "", formulations[w].integrator, model, input);
        CHECK(input < 10 * model + 10 * run.rtol);
    }
    kempe_trajectory_free(exact);
    kempe_system_free(by_model);
    kempe_system_free(by_input);
    kempe_model_free(said);
    kempe_model_free(bare);
    kempe_context_free(context);
}

/* An input that is set between single steps acts in the next one. */
static void an_input_acts_in_the_next_step(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = wheel_new(context);
    kempe_system *system = NULL;
    kempe_stepper *stepper = NULL;
    double torque = 0, impulse = 0;
    kempe_run_options run = settings(NULL, NULL);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    kempe_system_set_force(system, push, &torque);
    CHECK(kempe_stepper_new(system, &run, &stepper) == KEMPE_OK);
    for (int k = 0; stepper && kempe_stepper_time(stepper) < run.t_end && k < 1000; k++) {
        double t = kempe_stepper_time(stepper);
        torque = k % 3;
        CHECK(kempe_stepper_step(stepper) == KEMPE_OK);
        impulse += torque * (kempe_stepper_time(stepper) - t);
        CHECK_NEAR(kempe_stepper_qd(stepper)[0], impulse, 1e-12);
    }
    kempe_stepper_free(stepper);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

/* A force that reads nothing else takes the steps of kempe_simulate, also after inputs that changed; beyond them they
 * cost less than three evaluations a call. */
static void inputs_that_are_kept(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = four_bar_new(context, NULL);
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_stepper *kept = NULL, *sampled = NULL;
    double torque = 0.2;
    kempe_run_options run = settings(NULL, NULL);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    kempe_system_set_force(system, push, &torque);
    CHECK(simulate_rows(system, run, &trajectory) == KEMPE_OK);
    CHECK(kempe_stepper_new(system, &run, &kept) == KEMPE_OK);
    CHECK(kempe_stepper_new(system, &run, &sampled) == KEMPE_OK);
    kempe_stepper_keep_inputs(kept, 1);
    for (int k = 0; k <= ROWS && kept && sampled && trajectory; k++) {
        CHECK(kempe_stepper_advance(kept, kempe_trajectory_time(trajectory, k)) == KEMPE_OK);
        CHECK(kempe_stepper_advance(sampled, kempe_trajectory_time(trajectory, k)) == KEMPE_OK);
        check_row(kept, trajectory, k);
    }
    kempe_work a = kempe_stepper_work(kept), b = kempe_stepper_work(sampled);
    printf("  kept: %ld steps, %ld evaluations; sampled in %d calls: %ld steps, %ld evaluations\n", a.steps, a.rhs,
           ROWS, b.steps, b.rhs);
    CHECK(b.steps <= a.steps + ROWS);
    kempe_stepper_free(kept);
    kempe_stepper_free(sampled);
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(reduced);
    TEST(projected);
    TEST(dae);
    TEST(single_steps);
    TEST(options_that_are_gone);
    TEST(reasons_are_of_the_last_call);
    TEST(steps_inside_a_step);
    TEST(refused);
    TEST(interrupted);
    TEST(sampled_torque);
    TEST(sampled_torque_on_a_loop);
    TEST(an_input_acts_in_the_next_step);
    TEST(inputs_that_are_kept);
    return check_report();
}
