/* SPDX-License-Identifier: BSD-3-Clause */
/* Every formulation against digits that Kempe did not produce: examples' reference.csv, the IFToMM and Modelica
 * problems of tests/models. A choice of u that fails must be reported. */
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "integrators/sundials/linear.h"
#include "loaded.h"
#include "output/reference.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <stdlib.h>

enum { LARGEST = 32 };

/* The last row of a run, and how many came. */
typedef struct last_row {
    const kempe_system *s;
    double t, q[LARGEST], qd[LARGEST], qdd[LARGEST], lambda[LARGEST];
    int rows;
    unsigned long allocations[2]; /* at the first and at the last row */
    const kmp_reference *reference;
    double error[3]; /* q, qd, lambda over all rows with reference values */
} last_row;

static void measure(last_row *r)
{
    const double *got[3] = {r->q, r->qd, r->lambda};
    const kmp_quantity quantity[3] = {KMP_QUANTITY_Q, KMP_QUANTITY_QD, KMP_QUANTITY_LAMBDA};
    for (int k = 0; k < r->reference->rows; k++) {
        if (r->reference->t[k] != r->t)
            continue;
        for (int e = 0; e < 3; e++) {
            int count = quantity[e] == KMP_QUANTITY_LAMBDA ? r->s->m : r->s->n;
            for (int i = 0; i < count; i++) {
                double ref = r->reference->value[quantity[e]][k * count + i];
                if (!isnan(ref))
                    r->error[e] = fmax(r->error[e], fabs(got[e][i] - ref) / fmax(fabs(ref), 1));
            }
        }
    }
}

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    last_row *r = user;
    (void)work;
    r->t = t;
    if (r->s->n > LARGEST || r->s->m > LARGEST)
        return 1;
    for (int i = 0; i < r->s->n; i++) {
        r->q[i] = q[i];
        r->qd[i] = qd[i];
        r->qdd[i] = qdd[i];
    }
    for (int i = 0; i < r->s->m; i++)
        r->lambda[i] = lambda[i];
    r->allocations[r->rows++ > 0] = kmp_memory_count();
    if (r->reference)
        measure(r);
    return 0;
}

/* Set by tests that keep u as it is. */
static bool keep_independent;

static kempe_status run(const loaded *l, const char *formulation, const char *form, double rtol, double t_end,
                        int count, const double *times, last_row *row, char **reason)
{
    kmp_run_report report;
    kmp_run_spec spec = {.formulation = formulation,
                         .form = form,
                         .integrator = independent_integrator(formulation),
                         .rtol = rtol,
                         .t_end = t_end,
                         .time_count = count,
                         .times = times,
                         .keep_independent = keep_independent};
    const kmp_reference *reference = row->reference;
    *row = (last_row){.s = l->system, .reference = reference};
    kempe_status status = kmp_run_resolve(l->system, &spec);
    CHECK(status == KEMPE_OK);
    status = kmp_run(l->system, &spec, NULL, take_row, row, &report);
    if (reason)
        *reason = report.reason;
    else
        kmp_free(report.reason);
    return status;
}

/* Errors against an example's reference.csv over all its times up to t_end. */
static void against_reference(const char *example, const char *formulation, const char *form, double rtol, double t_end,
                              const double allowed[3])
{
    loaded l = load(example);
    char path[512];
    kmp_reference reference;
    last_row row = {0};
    snprintf(path, sizeof path, "%s/%s", KEMPE_ROOT, example);
    snprintf(strrchr(path, '/'), 32, "/reference.csv");
    CHECK(kmp_reference_read(l.system, path, &reference) == KEMPE_OK);
    int count = 0;
    while (count < reference.rows && reference.t[count] <= t_end)
        count++;
    CHECK(count > 1 && reference.t[count - 1] == t_end);
    row.reference = &reference;
    CHECK(run(&l, formulation, form, rtol, t_end, count, reference.t, &row, NULL) == KEMPE_OK);
    CHECK(row.rows == count);
    printf("  %-34s %s/%-8s rtol %.0e t %-5g q %.1e qd %.1e lambda %.1e\n", example, formulation, form, rtol, t_end,
           row.error[0], row.error[1], row.error[2]);
    for (int e = 0; e < 3; e++)
        CHECK(row.error[e] <= allowed[e]);
    kmp_samples_free(&reference);
    unload(&l);
}

static void andrews_reaches_its_digits(void)
{
    const double ode[3] = {1e-10, 1e-8, 1e-8}, dae[3] = {1e-7, 1e-5, 1e-5};
    for (int k = 0; k < 2; k++) {
        double t_end = k ? 0.05 : 0.03;
        against_reference("examples/andrews/andrews.yaml", "reduced", "integrated", 1e-12, t_end, ode);
        against_reference("examples/andrews/andrews.yaml", "reduced", "newton", 1e-12, t_end, ode);
        against_reference("examples/andrews/andrews.yaml", "projected", "none", 1e-12, t_end, ode);
        against_reference("examples/andrews/andrews.yaml", "dae", "stabilized1", 1e-12, t_end, dae);
    }
}

/* The other forms of the dae formulation, at a tolerance that each one stands. */
static void forms_reach_their_digits(void)
{
    const double fine[3] = {1e-8, 1e-5, 1e-6}, coarse[3] = {1e-2, 1, 0.1};
    against_reference("examples/andrews/andrews.yaml", "dae", "ggl", 1e-12, 0.03, fine);
    against_reference("examples/andrews/andrews.yaml", "dae", "index2", 1e-12, 0.03, fine);
    against_reference("examples/andrews/andrews.yaml", "dae", "index1", 1e-12, 0.03, fine);
    against_reference("examples/andrews/andrews.yaml", "dae", "index3", 1e-8, 0.03, coarse);
}

static void linkages_reach_their_digits(void)
{
    const double allowed[3] = {1e-8, 1e-8, 1e-8};
    const char *const models[2] = {"examples/four_bar/four_bar.yaml", "examples/slider_crank/slider_crank.yaml"};
    for (int k = 0; k < 2; k++) {
        double t_end = k ? 10 : 5;
        against_reference(models[k], "reduced", "integrated", 1e-12, t_end, allowed);
        against_reference(models[k], "reduced", "newton", 1e-12, t_end, allowed);
        against_reference(models[k], "projected", "none", 1e-12, t_end, allowed);
    }
}

/* Planar loops with hinges in space: most rows are redundant, the digits are those in the plane. */
static void planar_loops_in_space_reach_their_digits(void)
{
    static const struct {
        const char *model;
        double t_end, allowed[3];
    } models[] = {{"examples/slider_crank_spatial/slider_crank_spatial.yaml", 10, {1e-8, 1e-8, 0}},
                  {"examples/n_four_bar_spatial/n_four_bar_spatial.yaml", 20, {1e-6, 0, 0}},
                  {"examples/parallel_robot/parallel_robot.yaml", 2, {1e-10, 1e-9, 0}},
                  {"examples/parallel_robot/parallel_robot_spatial.yaml", 2, {1e-10, 1e-9, 0}}};
    const double dae[3] = {1e-5, 1e-4, 0};
    for (size_t k = 0; k < sizeof models / sizeof *models; k++) {
        against_reference(models[k].model, "reduced", "integrated", 1e-12, models[k].t_end, models[k].allowed);
        against_reference(models[k].model, "reduced", "newton", 1e-12, models[k].t_end, models[k].allowed);
        against_reference(models[k].model, "projected", "none", 1e-12, models[k].t_end, models[k].allowed);
        against_reference(models[k].model, "dae", "stabilized1", 1e-11, models[k].t_end, dae);
    }
}

static void andrews_starts_with_the_published_accelerations(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    const double zero = 0;
    last_row row = {0};
    static const char *const methods[4][2] = {
        {"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"}, {"dae", "stabilized1"}};
    for (int k = 0; k < 4; k++) {
        CHECK(run(&l, methods[k][0], methods[k][1], 1e-6, 1e-6, 1, &zero, &row, NULL) == KEMPE_OK);
        CHECK_NEAR(row.qdd[0], 14222.4439199541138705911625887, 1e-10);
        CHECK_NEAR(row.qdd[1], -10666.8329399655854029433719415, 1e-10);
        CHECK_NEAR(row.lambda[0], 98.5668703962410896057654982170, 1e-10);
        CHECK_NEAR(row.lambda[1], -6.12268834425566265503114393122, 1e-10);
        for (int i = 2; i < 6; i++)
            CHECK_NEAR(row.lambda[i], 0, 1e-10);
    }
    unload(&l);
}

static void spatial_problems_reach_their_digits(void)
{
    static const char *const methods[3][2] = {{"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"}};
    double end = 10;
    last_row row = {0};
    for (int k = 0; k < 3; k++) {
        loaded l = load("tests/models/pendulum.yaml");
        CHECK(run(&l, methods[k][0], methods[k][1], 1e-12, 10, 1, &end, &row, NULL) == KEMPE_OK);
        CHECK_NEAR(-cos(row.q[0]), -0.275087462576116860, 1e-9); /* IFToMM A01 */
        CHECK_NEAR(-sin(row.q[0]), -0.961419205099125064, 1e-9);
        unload(&l);

        l = load("tests/models/fourbar2.yaml"); /* Modelica Fourbar2, recomputed in quadruple precision */
        double five = 5;
        CHECK(run(&l, methods[k][0], methods[k][1], 1e-12, 5, 1, &five, &row, NULL) == KEMPE_OK);
        CHECK_NEAR(row.q[0], 40.2420250649953602, 1e-10);
        CHECK_NEAR(row.qd[0], 11.6350069101560833, 1e-9);
        CHECK_NEAR(row.q[1], -0.417541177807820895, 1e-10);
        unload(&l);

        l = load("tests/models/bricard_balls.yaml"); /* IFToMM A04: P3 after 10 s; 6 rows of rank 4 */
        CHECK(run(&l, methods[k][0], methods[k][1], 1e-12, 10, 1, &end, &row, NULL) == KEMPE_OK);
        kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
        const double *p3 = kmp_eval_shown(eval, 10, row.q, row.qd, row.qdd, row.lambda);
        CHECK_NEAR(p3[0], 0.999730987303835346, 1e-9);
        CHECK_NEAR(p3[1], -0.999999963825817275, 1e-9);
        CHECK_NEAR(p3[2], -2.68976512249305e-4, 1e-9);
        kmp_eval_free(eval);
        unload(&l);
    }
}

/* Bennett's loop turns several times; the independent two of its six rows must be chosen anew on the way. */
static void bennett_keeps_its_closed_form(void)
{
    loaded l = load("tests/models/bennett_balls.yaml");
    static const char *const methods[3][2] = {{"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"}};
    double end = 10, alpha = 40 * M_PI / 180, beta = 75 * M_PI / 180, first = 0;
    double k = sin((beta + alpha) / 2) / sin((beta - alpha) / 2);
    last_row row = {0};
    for (int method = 0; method < 3; method++) {
        CHECK(run(&l, methods[method][0], methods[method][1], 1e-11, 10, 1, &end, &row, NULL) == KEMPE_OK);
        CHECK_NEAR(tan(row.q[0] / 2) * tan(row.q[1] / 2), k, 1e-12);
        CHECK_NEAR(row.q[2], -row.q[0], 1e-13);
        first = method == 0 ? row.q[0] : first;
        CHECK_NEAR(row.q[0], first, 1e-9);
        CHECK(row.q[0] > 20); /* it did turn */
    }
    unload(&l);
}

/* A fixed u dies at a dead centre: at no tolerance may the run end well. */
static void a_fixed_choice_of_u_says_so(void)
{
    loaded l = load("tests/models/triple_rocker.yaml");
    double end = 3;
    last_row row = {0};
    keep_independent = true;
    for (int k = 0; k <= 36; k++) {
        double rtol = pow(10, -4 - 0.25 * k);
        for (int form = 0; form < 2; form++) {
            char *reason = NULL;
            kempe_status status = run(&l, "reduced", form ? "newton" : "integrated", rtol, 3, 1, &end, &row, &reason);
            CHECK(status == KEMPE_E_FAILED);
            CHECK(reason && strstr(reason, "dead centre") && strstr(reason, "'B'"));
            kmp_free(reason);
        }
    }
    keep_independent = false;
    unload(&l);
}

static int said_projected;

static void listen(void *user, kempe_level level, const char *text)
{
    (void)user, (void)level;
    said_projected += strstr(text, "the run continues with the projected formulation, which needs none") != NULL;
}

/* If no formulation was requested, a reduced one that stops hands over to the projected one, which is correct, and is
 * reported. */
static void the_projected_formulation_takes_over(void)
{
    loaded l = load("tests/models/triple_rocker.yaml");
    double end = 3;
    last_row right = {0}, row = {0};
    CHECK(run(&l, "projected", NULL, 1e-13, 3, 1, &end, &right, NULL) == KEMPE_OK);
    kempe_context_set_log(l.context, listen, NULL);
    for (int requested = 0; requested < 2; requested++)
        for (int k = 0; k <= 8; k++) {
            kmp_run_report report;
            kmp_run_spec spec = {.formulation = requested ? "reduced" : NULL,
                                 .rtol = pow(10, -4 - k),
                                 .t_end = 3,
                                 .time_count = 1,
                                 .times = &end};
            CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
            CHECK(spec.open == !requested);
            spec.keep_independent = true; /* so that the reduced formulation stops at a dead centre */
            row = (last_row){.s = l.system};
            said_projected = 0;
            kempe_status status = kmp_run(l.system, &spec, NULL, take_row, &row, &report);
            CHECK(status == (requested ? KEMPE_E_FAILED : KEMPE_OK) && said_projected == !requested);
            for (int i = 0; i < 3 && !requested; i++)
                CHECK_NEAR(row.q[i], right.q[i], fmax(3e3 * spec.rtol, 1e-7)); /* rounding times |dv/du|^3 */
            kmp_free(report.reason);
        }
    unload(&l);
}

/* With exchanges it comes through, the answer following the tolerance. */
static void exchanges_carry_through_dead_centres(void)
{
    loaded l = load("tests/models/triple_rocker.yaml");
    double end = 3;
    last_row right = {0}, row = {0};
    CHECK(run(&l, "projected", NULL, 1e-13, 3, 1, &end, &right, NULL) == KEMPE_OK);
    for (int k = 0; k <= 32; k++) {
        double rtol = pow(10, -4 - 0.25 * k);
        for (int form = 0; form < 2; form++) {
            CHECK(run(&l, "reduced", form ? "newton" : "integrated", rtol, 3, 1, &end, &row, NULL) == KEMPE_OK);
            for (int i = 0; i < 3; i++)
                CHECK_NEAR(row.q[i], right.q[i], fmax(3e3 * rtol, 1e-9));
        }
    }
    unload(&l);
}

/* Every single coordinate of Andrews as u, kept or exchanged: right, refused at the start, or failed with a reason. */
static void no_choice_of_u_is_silently_wrong(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    double end = 0.03;
    last_row row = {0};
    int good[2] = {0}, failed[2] = {0};
    for (int u = 0; u < 7; u++)
        for (int method = 0; method < 4; method++) {
            kmp_run_report report;
            kmp_run_spec spec = {.formulation = "reduced",
                                 .form = method & 1 ? "newton" : "integrated",
                                 .rtol = 1e-9,
                                 .t_end = end,
                                 .time_count = 1,
                                 .times = &end,
                                 .u = &u,
                                 .u_count = 1,
                                 .keep_independent = method & 2};
            row = (last_row){.s = l.system};
            CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
            kempe_status status = kmp_run(l.system, &spec, NULL, take_row, &row, &report);
            if (status == KEMPE_OK)
                CHECK_NEAR(row.q[0], 15.810771195153707, 1e-6);
            else
                CHECK(status == KEMPE_E_FAILED && report.reason && strlen(report.reason) > 20);
            good[method >> 1] += status == KEMPE_OK;
            failed[method >> 1] += status != KEMPE_OK;
            kmp_free(report.reason);
        }
    printf("  7 choices of u, 2 forms: exchanged %d right, %d failed with a reason; fixed %d and %d\n", good[0],
           failed[0], good[1], failed[1]);
    CHECK(good[0] >= 4 && good[1] == 4 && failed[1] == 10);
    unload(&l);
}

/* All factorisations are of the same matrices: Andrews comes out the same. */
static void linear_solvers_agree(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    double end = 0.03, first[7] = {0};
    last_row row;
    for (int k = 0; kmp_linear_name(k); k++) {
        kmp_run_report report;
        kmp_run_spec spec = {.formulation = "dae",
                             .linear = kmp_linear_name(k),
                             .rtol = 1e-12,
                             .t_end = end,
                             .time_count = 1,
                             .times = &end};
        row = (last_row){.s = l.system};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l.system, &spec, NULL, take_row, &row, &report) == KEMPE_OK);
        for (int i = 0; i < 7; i++) {
            first[i] = k ? first[i] : row.q[i];
            CHECK_NEAR(row.q[i], first[i], 1e-9);
        }
        printf("  %-8s %ld steps, %ld factorisations\n", kmp_linear_name(k), report.steps, report.factorizations);
        kmp_free(report.reason);
    }
    unload(&l);
}

/* Cost of the dae formulation at rtol 1e-8: one residual an iteration, few matrices, no more steps than known; and
 * equal bits in a second run. */
static void the_dae_formulation_costs_what_is_known(void)
{
    static const struct {
        const char *form;
        long steps, newton, factorizations;
    } known[] = {
        {"stabilized1", 790, 2000, 49}, {"ggl", 890, 2020, 89}, {"index2", 840, 2050, 70}, {"index1", 730, 1590, 48}};
    loaded l = load("examples/andrews/andrews.yaml");
    double end = 0.03, first[7] = {0};
    for (int k = 0; k < 8; k++) {
        last_row row = {.s = l.system};
        kmp_run_report r;
        kmp_run_spec spec = {.formulation = "dae",
                             .form = known[k / 2].form,
                             .linear = "klu",
                             .rtol = 1e-8,
                             .t_end = end,
                             .time_count = 1,
                             .times = &end};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l.system, &spec, NULL, take_row, &row, &r) == KEMPE_OK);
        CHECK(fabs((double)r.steps / (double)known[k / 2].steps - 1) < 0.1);
        CHECK((double)r.newton < 1.1 * (double)known[k / 2].newton);
        CHECK((double)r.factorizations < 1.3 * (double)known[k / 2].factorizations);
        CHECK(r.rhs == r.newton);
        CHECK(k % 2 == 0 || memcmp(first, row.q, sizeof first) == 0);
        memcpy(first, row.q, sizeof first);
        printf("  %-6s %ld steps, %ld iterations, %ld factorisations\n", known[k / 2].form, r.steps, r.newton,
               r.factorizations);
        kmp_free(r.reason);
    }
    unload(&l);
}

static double energy(kmp_evaluator *eval, const last_row *r)
{
    kmp_eval_closure(eval, r->t, r->q);
    kmp_eval_mass(eval);
    return kmp_eval_kinetic(eval, r->qd) + kmp_eval_potential(eval, r->t, r->q);
}

/* A formulation that goes through a change of mobility at all keeps the energy; the others say where they stopped. */
static void a_change_of_mobility_swallows_no_energy(void)
{
    static const char *const methods[4][2] = {
        {"reduced", "integrated"}, {"reduced", "newton"}, {"projected", "none"}, {"dae", "stabilized1"}};
    loaded l = load("tests/models/parallelogram.yaml");
    kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
    int through[4] = {0};
    for (int method = 0; method < 4; method++)
        for (int k = 0; k <= 24; k++) {
            last_row first = {0}, last = {0};
            double zero = 0, end = 2, rtol = pow(10, -4 - 0.25 * k);
            char *reason = NULL;
            CHECK(run(&l, methods[method][0], methods[method][1], rtol, 2, 1, &zero, &first, NULL) != KEMPE_E_BUG);
            kempe_status status = run(&l, methods[method][0], methods[method][1], rtol, 2, 1, &end, &last, &reason);
            CHECK(status == KEMPE_OK);
            CHECK(fabs(energy(eval, &last) - energy(eval, &first)) < 0.2); /* J, of seventeen */
            through[method] += status == KEMPE_OK;
            kmp_free(reason);
        }
    printf("  25 tolerances, through: integrated %d, newton %d, projected %d, dae %d\n", through[0], through[1],
           through[2], through[3]);
    kmp_eval_free(eval);
    unload(&l);
}

/* u stays: an exchange makes its reduction anew. */
static void stepping_allocates_nothing(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    const double times[3] = {0, 0.015, 0.03};
    last_row row = {0};
    kmp_method method;
    for (int k = 0; kmp_method_get(k, &method); k++) {
        kmp_run_report report;
        kmp_run_spec spec = {.formulation = method.formulation,
                             .form = method.form,
                             .integrator = method.integrator,
                             .rtol = 1e-8,
                             .t_end = 0.03,
                             .time_count = 3,
                             .times = times,
                             .keep_independent = strcmp(method.formulation, "reduced") == 0};
        row = (last_row){.s = l.system};
        CHECK(kmp_run_resolve(l.system, &spec) == KEMPE_OK);
        CHECK(kmp_run(l.system, &spec, NULL, take_row, &row, &report) == KEMPE_OK);
        CHECK(row.rows == 3 && row.allocations[1] == row.allocations[0]);
        CHECK_NEAR(row.q[0], 15.810771195153707, strcmp(method.form, "index3") ? 1e-5 : 1e-2);
        kmp_free(report.reason);
    }
    unload(&l);
}

int main(void)
{
    TEST(andrews_starts_with_the_published_accelerations);
    TEST(andrews_reaches_its_digits);
    TEST(forms_reach_their_digits);
    TEST(linkages_reach_their_digits);
    TEST(planar_loops_in_space_reach_their_digits);
    TEST(spatial_problems_reach_their_digits);
    TEST(bennett_keeps_its_closed_form);
    TEST(a_fixed_choice_of_u_says_so);
    TEST(the_projected_formulation_takes_over);
    TEST(exchanges_carry_through_dead_centres);
    TEST(no_choice_of_u_is_silently_wrong);
    TEST(linear_solvers_agree);
    TEST(the_dae_formulation_costs_what_is_known);
    TEST(a_change_of_mobility_swallows_no_energy);
    TEST(stepping_allocates_nothing);
    return check_report();
}
