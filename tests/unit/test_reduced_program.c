/* SPDX-License-Identifier: BSD-3-Clause */
/* The reduced right-hand side as one program against the same by parts, on the examples and on forces that depend on
 * multipliers: at the start, and at states along the motion for which the order of elimination was not chosen. */
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/tolerances.h"
#include "random.h"
#include "states.h"
#include "testing.h"
#include <float.h>
#include <math.h>

enum { STATES = 8, FAR = 40, MOST_ROWS = 200 };

static int worn;

static const char *const examples[] = {"andrews/andrews",
                                       "four_bar/four_bar",
                                       "n_four_bar/n_four_bar_40",
                                       "bricard/bricard",
                                       "stewart/stewart",
                                       "governor/governor",
                                       "double_wishbone/double_wishbone",
                                       "stephenson/stephenson",
                                       "bennett/bennett",
                                       "jansen_leg/jansen_leg",
                                       "slider_crank/slider_crank",
                                       "peaucellier/peaucellier",
                                       "parallel_robot/parallel_robot_spatial",
                                       "n_four_bar_spatial/n_four_bar_spatial",
                                       "slider_crank_spatial/slider_crank_spatial",
                                       "driven_slider_crank/driven_slider_crank",
                                       "../tests/models/braked",
                                       "../tests/models/guide_friction",
                                       "../tests/models/guide_friction_carrier"};

/* (u, ud, v) */
static void put_state(const kmp_partition *part, const double *q, const double *qd, double *y)
{
    for (int k = 0; k < part->p; k++) {
        y[k] = q[part->u[k]];
        y[part->p + k] = qd[part->u[k]];
    }
    for (int i = 0; i < part->r; i++)
        y[2 * part->p + i] = q[part->v[i]];
}

/* Values at the end of a step, compared with the evaluator and the reduction at their states. */
static double difference_at_end(kmp_reduced_program *fused, kmp_reduction *red)
{
    const kmp_evaluator *eval = red->eval;
    const kempe_system *s = eval->system;
    kmp_reduced_program_end end = kmp_reduced_program_at_end(fused);
    double worst = 0, closed = kmp_eval_residual(eval);
    for (int k = 0; k < s->m; k++)
        worst = check_max(worst, fabs(end.h[k] - eval->h[k]) / s->row_scale[k]);
    worst = check_max(worst, check_apart(s->jacobian.count, end.jacobian, eval->jacobian));
    CHECK(!end.h_t == !eval->h_t);
    if (end.h_t)
        worst = check_max(worst, check_apart(s->m, end.h_t, eval->h_t));
    CHECK(end.regular);
    if (red->r == 0)
        return worst;
    kmp_reduction_correction(red);
    int signs[MOST_ROWS];
    CHECK(red->r <= MOST_ROWS);
    kmp_block_take_signs(red->block, signs);
    for (int b = kmp_block_count(red->block); end.good && b-- > 0;)
        CHECK(end.signs[b] == signs[b]);
    worst = check_max(worst, check_apart(red->r * red->p, end.bvu, red->bvu));
    return closed > 1e-6 ? check_max(worst, check_apart(red->r, end.dv, red->dv)) : worst;
}

/* The largest difference of qd and udd, and of what the end of a step is told, each beside its own largest number. */
static double difference(kmp_reduced_program *fused, kmp_reduction *red, double t, const double *q, const double *all)
{
    int n = red->n, p = red->p;
    double *ud = KMP_NEW(double, 4 * n + 3 * p), *qd = ud + n, *udd = qd + n, *y = udd + p, *dy = y + n + p;
    double worst = 0, size = 1e-300, rates = 1e-300;
    for (int k = 0; k < p; k++)
        ud[k] = all[red->part->u[k]];
    kmp_eval_closure(red->eval, t, q);
    CHECK(kmp_reduction_factor(red) == 0);
    kmp_reduction_tangent(red);
    kmp_reduction_rates(red, ud, qd);
    kmp_eval_mass(red->eval);
    kmp_eval_bias(red->eval, qd);
    CHECK(kmp_reduction_accelerate(red, udd) == 0);
    put_state(red->part, q, all, y);
    CHECK(kmp_reduced_program_run(fused, t, y, dy));
    for (int k = 0; k < p; k++)
        size = check_max(size, fabs(udd[k]));
    for (int i = 0; i < n; i++)
        rates = check_max(rates, fabs(qd[i]));
    size = check_max(size, rates * rates); /* where all accelerations are but rounding */
    for (int k = 0; k < p; k++)
        worst = check_max(worst, fabs(udd[k] - dy[p + k]) / size);
    for (int k = 0; k < p; k++)
        worst = check_max(worst, fabs(ud[k] - dy[k]) / rates);
    for (int i = 0; i < red->r; i++)
        worst = check_max(worst, fabs(qd[red->part->v[i]] - dy[2 * p + i]) / rates);
    if (red->eval->system->dissipative) {
        double *qdd = KMP_NEW(double, n + red->eval->system->m), *lambda = qdd + n;
        kmp_reduction_accelerations(red, udd, qdd);
        kmp_reduction_multipliers(red, qdd, lambda);
        double power = kmp_eval_power_here(red->eval, qd) + kmp_eval_drive_power(red->eval, lambda);
        kmp_free(qdd);
        worst = check_max(worst, fabs(kmp_reduced_program_power(fused) - power) / check_max(fabs(power), size));
    }
    worst = check_max(worst, difference_at_end(fused, red));
    kmp_free(ud);
    return worst;
}

/* As `apart`; numbers are at least of this size. */
static double apart_of(int count, const double *a, const double *b, double least)
{
    double off = 0, size = least;
    for (int i = 0; i < count; i++) {
        off = check_max(off, fabs(a[i] - b[i]));
        size = check_max(size, fabs(b[i]));
    }
    return off / size;
}

/* Rows of results from states whose v is off by some 1e-6 scales, beside those by parts: the largest difference of q,
 * qd, qdd and multipliers, each beside its own largest number. Coordinates are closed to round-off. */
static double difference_of_row(kmp_reduced_program *fused, kmp_reduction *red, double t, const double *q,
                                const double *all)
{
    const kmp_evaluator *eval = red->eval;
    const kmp_partition *part = red->part;
    int n = red->n, p = red->p, r = red->r, m = part->m;
    double *own = KMP_NEW(double, 6 * n + 6 * p + 2 * m + 2 * r), *qd = own + n, *qdd = qd + n, *beside = qdd + n;
    double *rates = beside + n, *accelerations = rates + n, *ud = accelerations + n, *udd = ud + p;
    double *lambda = udd + p, *other = lambda + m;
    kmp_reduced_program_row row = {.program = fused, .y = other + m};
    row.dy = row.y + 2 * p + r;
    row.dx = red->dv;
    memcpy(own, q, (size_t)n * sizeof *own);
    for (int i = 0; i < r; i++)
        own[part->v[i]] += 1e-6 * cos(1 + i) * eval->system->scale[part->v[i]];
    memcpy(beside, own, (size_t)n * sizeof *own);
    put_state(part, own, all, row.y);
    CHECK(kmp_reduced_program_close_row(&row, t, own) && (r == 0 || row.corrections > 1));
    kmp_reduced_program_rates(&row, qd);
    kmp_reduced_program_complete_row(&row, qdd, lambda);
    for (int k = 0; k < p; k++)
        ud[k] = all[part->u[k]];
    CHECK(kmp_reduction_close(red, t, beside, NULL, 0) == 0);
    kmp_eval_closure(red->eval, t, beside);
    CHECK(kmp_reduction_factor(red) == 0);
    kmp_reduction_tangent(red);
    kmp_reduction_rates(red, ud, rates);
    kmp_eval_mass(red->eval);
    CHECK(kmp_reduction_move(red, rates, udd) == 0);
    kmp_reduction_accelerations(red, udd, accelerations);
    kmp_reduction_multipliers(red, accelerations, other);
    double fastest = 1e-300; /* where accelerations are but rounding */
    for (int i = 0; i < n; i++)
        fastest = check_max(fastest, fabs(rates[i]));
    double worst = check_max(apart_of(n, own, beside, 1), apart_of(n, qd, rates, 1e-300));
    worst = check_max(worst, apart_of(n, qdd, accelerations, fastest * fastest));
    worst = check_max(worst, apart_of(m, lambda, other, 1e-300));
    kmp_free(own);
    return worst;
}

/* Predicted v, off by `off` scales, is corrected, and the rest is evaluated at the corrected v, whose sines and cosines
 * are turned: beside the program without corrections there. Returns the largest difference, relative to the largest
 * number. */
static double difference_closing(kmp_reduced_program *closing, kmp_reduced_program *plain, const kmp_reduction *red,
                                 double t, double *y, double off)
{
    int p = red->p, r = red->r, size = 2 * p + r;
    double *dy = KMP_NEW(double, 2 * size), *beside = dy + size, most = 1e-300;
    for (int i = 0; i < r; i++)
        y[2 * p + i] += off * cos(1 + i) * red->eval->system->scale[red->part->v[i]];
    kmp_writer_correction c = kmp_reduced_program_close(closing, t, y);
    CHECK(kmp_reduced_program_finish(closing, t, y, dy));
    CHECK(c.turn <= KMP_TURN_SMALL);
    for (int i = 0; i < r; i++)
        y[2 * p + i] += c.dv[i];
    CHECK(kmp_reduced_program_run(plain, t, y, beside));
    for (int i = 0; i < size; i++)
        most = check_max(most, fabs(beside[i]));
    double worst = 0;
    const double *left = kmp_reduced_program_left(closing), *open = kmp_reduced_program_at_end(plain).dv;
    for (int i = 0; i < size; i++)
        worst = check_max(worst, fabs(dy[i] - beside[i]) / most);
    for (int i = 0; i < r; i++) /* both are almost zero */
        worst = check_max(worst, fabs(left[i] - open[i]) / red->eval->system->scale[red->part->v[i]]);
    kmp_free(dy);
    return worst;
}

static void closed_along_the_motion(kmp_reduced_program *plain, const kmp_reduction *red, const states *at,
                                    const char *name)
{
    static const double offs[] = {0, 1e-9, 1e-5, 2e-4};
    kmp_reduced_program *closing = NULL;
    const double bound = (100 + 10 * red->r) * DBL_EPSILON; /* rounding adds up along a chain of loops */
    double *y = KMP_NEW(double, 2 * red->n), worst = 0;
    CHECK(kmp_reduced_program_new(&closing, red, true) == KEMPE_OK);
    for (int k = 0; closing && k < at->count; k++)
        for (size_t o = 0; o < sizeof offs / sizeof *offs; o++) {
            put_state(red->part, at->q + k * at->n, at->qd + k * at->n, y);
            worst = check_max(worst, difference_closing(closing, plain, red, at->t[k], y, offs[o]));
        }
    CHECK(closing && worst < bound);
    if (!(worst < bound))
        printf("  %s: %g by the closing program\n", name, worst);
    kmp_reduced_program_free(closing);
    kmp_free(y);
}

static bool is_good(kmp_reduced_program *fused, const kmp_reduction *red, double t, const double *q)
{
    double *y = KMP_NEW(double, 2 * red->n);
    put_state(red->part, q, q, y);
    bool good = kmp_reduced_program_is_good(fused, t, y);
    kmp_free(y);
    return good;
}

/* At coordinates that close nothing the order of elimination may be bad: it is either good, or said not to be. */
static void far_away(kmp_reduced_program *fused, kmp_reduction *red, const char *name)
{
    double *q = KMP_NEW(double, 2 * red->n), worst = 0;
    random_seed(3);
    for (int k = 0; k < FAR; k++) {
        for (int i = 0; i < 2 * red->n; i++)
            q[i] = between(-2, 2);
        double d = difference(fused, red, 0.3, q, q + red->n);
        if (!is_good(fused, red, 0.3, q))
            worn++;
        else
            worst = check_max(worst, red->block ? d * fmin(1, kmp_block_smallest(red->block)) : d);
    }
    CHECK(worst < 1e-10); /* multipliers up to ten may grow */
    if (!(worst < 1e-10))
        printf("  %s: %g\n", name, worst);
    kmp_free(q);
}

static void along_the_motion(const kempe_system *system, const states *at, const char *name)
{
    kmp_evaluator *eval = kmp_eval_new(system, "native");
    kmp_partition part;
    kmp_reduction red;
    kmp_reduced_program *fused = NULL, *closing = NULL;
    double worst = 0;
    int bad = 0;
    kmp_eval_closure(eval, 0, at->q);
    CHECK(kmp_partition_init(&part, system, eval->jacobian, NULL, 0) == KEMPE_OK);
    CHECK(kmp_reduction_init(&red, eval, &part) == KEMPE_OK && kmp_reduction_factor(&red) == 0);
    CHECK(kmp_reduced_program_new(&fused, &red, false) == KEMPE_OK);
    for (int k = 0; fused && k < at->count; k++) {
        double t = at->t[k], d = difference(fused, &red, t, at->q + k * at->n, at->qd + k * at->n);
        bad += !is_good(fused, &red, t, at->q + k * at->n);
        d = check_max(d, 0.1 * difference_of_row(fused, &red, t, at->q + k * at->n, at->qd + k * at->n));
        worst = check_max(worst, red.block ? d * fmin(1, kmp_block_smallest(red.block)) : d);
    }
    CHECK(fused && worst < 1e-13 && bad == 0);
    if (fused) {
        kmp_counts parts = kmp_program_count(system->motion, 1, system->motion->stages - 1),
                   one = kmp_reduced_program_count(fused);
        kmp_counts algebra = kmp_reduction_count(&red);
        printf("  %-36s p %d r %d: %.1e, %ld + %ld operations, as one %ld, worn out at %d states\n", name, part.p,
               part.r, worst, parts.paper, algebra.paper, one.paper, bad);
        CHECK(system->load_row_count > 0 || one.paper < parts.paper + algebra.paper); /* these take passes */
        kmp_eval_closure(eval, 0, at->q);
        CHECK(kmp_reduction_factor(&red) == 0);
        if (system->load_row_count == 0) {
            closed_along_the_motion(fused, &red, at, name);
            far_away(fused, &red, name);
        } else { /* which no program that closes has; far away multipliers may have no solution */
            CHECK(kmp_reduced_program_new(&closing, &red, true) == KEMPE_OK && !closing);
        }
    }
    kmp_reduced_program_free(fused);
    kmp_reduction_free(&red);
    kmp_partition_free(&part);
    kmp_eval_free(eval);
}

static void one_example(const char *name)
{
    char path[512];
    snprintf(path, sizeof path, "examples/%s.yaml", name);
    loaded l = load(path);
    states at;
    if (l.system && follow(l.system, STATES, &at)) {
        along_the_motion(l.system, &at, name);
        kmp_free(at.q);
    }
    unload(&l);
}

static void the_examples(void)
{
    for (size_t k = 0; k < sizeof examples / sizeof *examples; k++)
        one_example(examples[k]);
    CHECK(worn > 20);
}

int main(void)
{
    TEST(the_examples);
    return check_report();
}
