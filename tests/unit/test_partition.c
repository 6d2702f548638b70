/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* The choice of independent coordinates: rank and growth on random matrices, the same choice in metres and millimetres,
 * the user's wish. */
#include "base/memory.h"
#include "constraints/closing/assemble.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "constraints/partition/reduction.h"
#include "integrators/run/methods.h"
#include "integrators/run/run.h"
#include "loaded.h"
#include "random.h"
#include "testing.h"
#include <kempe/check.h>
#include <stdlib.h>

enum { MOST = 12 };

/* -- random matrices --------------------------------------------------------------------------------- */

/* m x n of rank r, column-major. */
static void make_matrix(int m, int n, int r, double *a)
{
    double left[MOST * MOST], right[MOST * MOST];
    for (int i = 0; i < m * r; i++)
        left[i] = between(-1, 1);
    for (int i = 0; i < r * n; i++)
        right[i] = between(-1, 1);
    for (int k = 0; k < n; k++)
        for (int i = 0; i < m; i++) {
            a[i + k * m] = 0;
            for (int j = 0; j < r; j++)
                a[i + k * m] += left[i + j * m] * right[j + k * r];
        }
}

/* All places of an m x n matrix, column by column. */
static kmp_pattern full(int m, int n)
{
    static int row[MOST * MOST], col[MOST * MOST];
    for (int k = 0; k < m * n; k++) {
        row[k] = k % m;
        col[k] = k / m;
    }
    return (kmp_pattern){m * n, row, col};
}

static bool is_permutation(const int *a, int a_count, const int *b, int b_count)
{
    int seen[MOST] = {0};
    for (int k = 0; k < a_count; k++)
        seen[a[k]]++;
    for (int k = 0; k < b_count; k++)
        seen[b[k]]++;
    for (int k = 0; k < a_count + b_count; k++)
        if (seen[k] != 1)
            return false;
    return true;
}

static bool same_choice(const kmp_partition *a, const kmp_partition *b)
{
    return a->p == b->p && a->r == b->r && memcmp(a->u, b->u, (size_t)a->p * sizeof(int)) == 0 &&
           memcmp(a->rows, b->rows, (size_t)a->r * sizeof(int)) == 0;
}

/* A mechanism with other units: columns and rows multiplied, the scales with them. Powers of two: exactly the
 * same numbers. */
static void is_the_same_in_other_units(const kempe_system *s, const double *a, const kmp_partition *part)
{
    double b[MOST * MOST], scale[MOST], row_scale[MOST];
    kempe_system other = *s;
    kmp_partition again;
    other.scale = scale;
    other.row_scale = row_scale;
    for (int k = 0; k < s->n; k++)
        scale[k] = ldexp(1, pick(21) - 10);
    for (int i = 0; i < s->m; i++)
        row_scale[i] = ldexp(1, pick(21) - 10);
    for (int k = 0; k < s->n; k++)
        for (int i = 0; i < s->m; i++)
            b[i + k * s->m] = a[i + k * s->m] * row_scale[i] / scale[k];
    CHECK(kmp_partition_init(&again, &other, b, NULL, 0) == KEMPE_OK);
    double cond = 0, other_cond = 1;
    CHECK(kmp_partition_condition(part, s, a, &cond) == KEMPE_OK && cond >= 1 - 1e-9);
    CHECK(kmp_partition_condition(&again, &other, b, &other_cond) == KEMPE_OK);
    CHECK(same_choice(part, &again) && again.max_b == part->max_b && other_cond == cond);
    kmp_partition_free(&again);
}

static void random_matrices_have_their_rank(void)
{
    kempe_context *context = kempe_context_new();
    double a[MOST * MOST], ones[MOST];
    for (int k = 0; k < MOST; k++)
        ones[k] = 1;
    random_seed(3);
    for (int trial = 0; trial < 2000; trial++) {
        int n = 1 + pick(MOST - 1), m = 1 + pick(MOST - 1), r = pick((m < n ? m : n) + 1);
        kempe_system s = {.n = n, .m = m, .scale = ones, .row_scale = ones, .context = context};
        s.jacobian = full(m, n);
        kmp_partition part;
        make_matrix(m, n, r, a);
        CHECK(kmp_partition_init(&part, &s, a, NULL, 0) == KEMPE_OK);
        CHECK(part.r == r && part.p == n - r && part.n == n && part.m == m && !part.user);
        CHECK(is_permutation(part.u, part.p, part.v, part.r));
        CHECK(is_permutation(part.rows, part.r, part.redundant, m - part.r));
        CHECK(part.max_b <= 1.5);
        is_the_same_in_other_units(&s, a, &part);
        kmp_partition_free(&part);
    }
    kempe_context_free(context);
}

/* -- one row more ------------------------------------------------------------------------------------ */

/* All places of an m x n matrix, row by row. */
static kmp_pattern by_rows(int m, int n)
{
    static int row[MOST * MOST], col[MOST * MOST];
    for (int k = 0; k < m * n; k++) {
        row[k] = k / n;
        col[k] = k % n;
    }
    return (kmp_pattern){m * n, row, col};
}

/* Mostly zeros; some rows are sums of two others. */
static void make_sparse(int m, int n, double *a)
{
    for (int i = 0; i < m; i++) {
        const int first = i > 1 && pick(4) == 0 ? pick(i) : -1, second = first < 0 ? 0 : pick(i);
        for (int k = 0; k < n; k++)
            a[i * n + k] = first >= 0 ? a[first * n + k] - 2 * a[second * n + k] : pick(4) == 0 ? between(-1, 1) : 0;
    }
}

static int rank_of(const kempe_system *s, const double *a)
{
    kmp_partition part;
    CHECK(kmp_partition_init(&part, s, a, NULL, 0) == KEMPE_OK);
    const int rank = part.r;
    kmp_partition_free(&part);
    return rank;
}

/* The rank of the rows that share coordinates tells what that of all rows does. */
static void a_row_adds_what_it_adds_to_all(void)
{
    kempe_context *context = kempe_context_new();
    double a[MOST * MOST], without[MOST * MOST], ones[MOST];
    int seen[2] = {0};
    for (int k = 0; k < MOST; k++)
        ones[k] = 1;
    random_seed(8);
    for (int trial = 0; trial < 1000; trial++) {
        const int n = 2 + pick(MOST - 2), m = 2 + pick(MOST - 2), row = pick(m);
        kempe_system s = {.n = n, .m = m, .scale = ones, .row_scale = ones, .context = context};
        kmp_row_links links;
        kmp_arena arena = {0};
        bool adds[2] = {false, true};
        s.jacobian = by_rows(m, n);
        make_sparse(m, n, a);
        memcpy(without, a, sizeof a);
        memset(without + row * n, 0, (size_t)n * sizeof *without);
        CHECK(kmp_row_links_init(&links, &s, &arena));
        for (int again = 0; again < 2; again++) /* the links are as before */
            CHECK(kmp_partition_adds(&s, a, &links, NULL, row, 1e-7, &adds[again]) == KEMPE_OK);
        CHECK(adds[0] == adds[1] && adds[0] == (rank_of(&s, a) > rank_of(&s, without)));
        seen[adds[0]]++;
        kmp_arena_free(&arena);
    }
    CHECK(seen[0] > 100 && seen[1] > 100);
    kempe_context_free(context);
}

/* Rows of other parts cost nothing: of many pairs one is looked at, in memory that is there. */
static void far_rows_cost_nothing(void)
{
    enum { PAIRS = 2000 };
    static int row[4 * PAIRS], col[4 * PAIRS];
    static double a[4 * PAIRS], ones[2 * PAIRS];
    kempe_context *context = kempe_context_new();
    kempe_system s = {.n = 2 * PAIRS, .m = 2 * PAIRS, .scale = ones, .row_scale = ones, .context = context};
    kmp_row_links links;
    kmp_arena arena = {0};
    for (int e = 0; e < 4 * PAIRS; e++) {
        row[e] = e / 2;
        col[e] = e / 4 * 2 + e % 2;
        a[e] = e % 4 == 3 && e / 4 % 2 ? -1 : 1; /* the rows of each second pair are equal */
        ones[e / 2] = 1;
    }
    s.jacobian = (kmp_pattern){4 * PAIRS, row, col};
    CHECK(kmp_row_links_init(&links, &s, &arena));
    const unsigned long before = kmp_memory_count();
    for (int k = 0; k < 2 * PAIRS; k++) {
        bool adds;
        CHECK(kmp_partition_adds(&s, a, &links, NULL, k, 1e-7, &adds) == KEMPE_OK && adds == (k / 2 % 2 == 1));
    }
    CHECK(kmp_memory_count() == before);
    kmp_arena_free(&arena);
    kempe_context_free(context);
}

/* -- metres and millimetres -------------------------------------------------------------------------- */

static char *file_text(const char *path)
{
    char full[512], *text = calloc(1, 1 << 16);
    snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    FILE *f = fopen(full, "r");
    CHECK(text && f && fread(text, 1, (1 << 16) - 1, f) > 0);
    if (f)
        fclose(f);
    return text;
}

/* The only `old` in the text replaced by `now`; the text is freed. */
static char *replaced(char *text, const char *old, const char *now)
{
    char *at = strstr(text, old), *out = calloc(1, strlen(text) + strlen(now) + 1);
    CHECK(at && out && !strstr(at + 1, old));
    if (at && out)
        sprintf(out, "%.*s%s%s", (int)(at - text), text, now, at + strlen(old));
    free(text);
    return out;
}

typedef struct last {
    double q[3], qd[3], lambda[2];
} last;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    last *l = user;
    (void)t, (void)qdd, (void)work;
    memcpy(l->q, q, sizeof l->q);
    memcpy(l->qd, qd, sizeof l->qd);
    memcpy(l->lambda, lambda, sizeof l->lambda);
    return 0;
}

static kmp_run_report run(const loaded *l, last *row)
{
    double end = 10;
    kmp_run_report report;
    kmp_run_spec spec = {
        .formulation = "reduced", .form = "integrated", .rtol = 1e-8, .t_end = end, .time_count = 1, .times = &end};
    CHECK(kmp_run_resolve(l->system, &spec) == KEMPE_OK);
    CHECK(kmp_run(l->system, &spec, NULL, take_row, row, &report) == KEMPE_OK);
    kmp_free(report.reason);
    return report;
}

/* Lengths in millimetres, so force, energy and gravity too are a thousand times as large (masses in kg). */
static void metres_and_millimetres_agree(void)
{
    char *text = file_text("examples/slider_crank/slider_crank.yaml");
    loaded m = load_text(text);
    text = replaced(text, "[0, -9.81, 0]", "[0, -9810, 0]");
    text = replaced(text, "r: 0.2, l: 0.5", "r: 200, l: 500");
    loaded mm = load_text(text);
    free(text);
    kempe_check *check_m = NULL, *check_mm = NULL;
    CHECK(kempe_check_new(m.system, &check_m) == KEMPE_OK && kempe_check_new(mm.system, &check_mm) == KEMPE_OK);
    CHECK(same_choice(&check_m->part, &check_mm->part));
    kempe_check_free(check_m);
    kempe_check_free(check_mm);
    last a, b;
    kmp_run_report in_m = run(&m, &a), in_mm = run(&mm, &b);
    CHECK(in_m.steps == in_mm.steps && in_m.rejected == in_mm.rejected && in_m.rhs == in_mm.rhs);
    for (int k = 0; k < 3; k++) {
        double unit = k == 2 ? 1000 : 1;
        CHECK_NEAR(b.q[k] / unit, a.q[k], 1e-11);
        CHECK_NEAR(b.qd[k] / unit, a.qd[k], 1e-10);
    }
    for (int k = 0; k < 2; k++)
        CHECK_NEAR(b.lambda[k] / 1000, a.lambda[k], 1e-10);
    unload(&m);
    unload(&mm);
}

/* -- wishes ------------------------------------------------------------------------------------------ */

/* The partition of the slider-crank with its crank at an angle. */
static kempe_status wish(double angle, int count, const int *u, kmp_partition *part, char *message, size_t size)
{
    char *text = file_text("examples/slider_crank/slider_crank.yaml"), start[128];
    snprintf(start, sizeof start, "{crank: %.17g, rod: %.17g, slider: 0}", angle, -1.4 * angle);
    text = replaced(text, "{crank: 0, rod: 0, slider: 0}", start);
    loaded l = load_text(text);
    kempe_assembly *a = NULL;
    CHECK(kempe_assembly_new(l.system, &a) == KEMPE_OK);
    kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
    kmp_eval_closure(eval, 0, a->q);
    kempe_status status = kmp_partition_init(part, l.system, eval->jacobian, u, count);
    snprintf(message, size, "%s", kempe_context_message(l.context));
    kmp_eval_free(eval);
    kempe_assembly_free(a);
    unload(&l);
    free(text);
    return status;
}

static void a_safe_wish_is_respected(void)
{
    char message[512];
    kmp_partition part;
    for (int u = 0; u < 3; u++) {
        CHECK(wish(0.9, 1, &u, &part, message, sizeof message) == KEMPE_OK);
        CHECK(part.user && part.p == 1 && part.u[0] == u && part.exchanges == 0);
        kmp_partition_free(&part);
    }
}

/* At the dead centre the slider stands still. */
static void an_unsafe_wish_is_refused(void)
{
    char message[512];
    const int slider = 2;
    kmp_partition part;
    CHECK(wish(0, 1, &slider, &part, message, sizeof message) == KEMPE_E_FAILED);
    CHECK(strstr(message, "'slider' cannot be independent here") && strstr(message, "possible choice: "));
    printf("  %s\n", message);
    CHECK(part.u == NULL && part.v == NULL);
    CHECK(wish(1e-7, 1, &slider, &part, message, sizeof message) == KEMPE_E_FAILED);
}

static void a_wrong_number_of_wishes_is_refused(void)
{
    char message[512];
    const int two[2] = {0, 2};
    kmp_partition part;
    CHECK(wish(0.9, 2, two, &part, message, sizeof message) == KEMPE_E_FAILED);
    CHECK(strstr(message, "has 1 degree of freedom, but 2 independent coordinates were given"));
    printf("  %s\n", message);
}

/* -- counts ------------------------------------------------------------------------------------------ */

/* By hand: u = rod, v = (crank, slider); Jv is two blocks of one with an entry between them, M has 3 entries on the
 * diagonal and one below, which counts twice. Factors: 2 quotients. A solve, for Bvu and for gamma: 1 + 2 products, 1
 * sum. M times a vector, for gamma and for X: 5 and 5. Rates of v: 2 and 2. Reduced force, reduced mass: 3 and 3.
 * Cholesky of order 1: a root, 2 quotients. */
static void the_arithmetic_is_that_counted_by_hand(void)
{
    char *text = file_text("examples/slider_crank/slider_crank.yaml");
    loaded l = load_text(text);
    kempe_check *check = NULL;
    kmp_reduction red;
    CHECK(kempe_check_new(l.system, &check) == KEMPE_OK);
    CHECK(check->part.p == 1 && check->part.u[0] == 1 && check->diagnosis.block_count == 2);
    kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
    CHECK(kmp_reduction_init(&red, eval, &check->part) == KEMPE_OK);
    kmp_counts c = kmp_reduction_count(&red);
    CHECK(c.add == 2 * 1 + 2 * 5 + 2 + 2 * 3 && c.mul == 2 * 3 + 2 * 5 + 2 + 2 * 3);
    CHECK(c.div == 2 + 2 && c.other == 1 && c.trig == 0);
    CHECK(c.paper == c.add + c.mul + c.div && c.robotran == c.paper + 1);
    kmp_reduction_free(&red);
    kmp_eval_free(eval);
    kempe_check_free(check);
    unload(&l);
    free(text);
}

/* -- zeros -------------------------------------------------------------------------------------------- */

/* Residual X' (M (X udd + a0) + C) with X and M dense, against its largest term; and J X. */
static void check_accelerations(kmp_reduction *red, const double *udd)
{
    int n = red->n, m = red->part->m;
    double *mass = KMP_NEW(double, n *n), *j = KMP_NEW(double, n *m), *qdd = KMP_NEW(double, n);
    kmp_eval_dense_mass(red->eval, mass);
    kmp_eval_dense_jacobian(red->eval, j);
    kmp_reduction_accelerations(red, udd, qdd);
    for (int k = 0; k < red->p; k++) {
        double sum = 0, size = 0;
        for (int i = 0; i < n; i++) {
            double force = red->eval->bias[i];
            for (int c = 0; c < n; c++)
                force += mass[i + c * n] * qdd[c];
            sum += red->x[i + k * n] * force;
            size = check_max(size, fabs(red->x[i + k * n]) * fmax(fabs(force), fabs(red->eval->bias[i])));
        }
        CHECK(fabs(sum) <= 1e-9 * fmax(size, 1));
        for (int row = 0; row < m; row++) {
            double along = 0;
            for (int i = 0; i < n; i++)
                along += j[row + i * m] * red->x[i + k * n];
            CHECK(fabs(along) < 1e-9);
        }
    }
    kmp_free(mass);
    kmp_free(j);
    kmp_free(qdd);
}

/* Models whose reduction skips zeros of J, M and X. */
static void accelerations_obey_the_whole_equations(void)
{
    static const char *const path[] = {"examples/limousine/limousine.yaml", "examples/limousine/limousine_corner.yaml",
                                       "examples/suspension/suspension.yaml", "examples/tram/tram.yaml"};
    for (int k = 0; k < 4; k++) {
        loaded l = load(path[k]);
        kempe_check *check = NULL;
        kmp_reduction red;
        CHECK(kempe_check_new(l.system, &check) == KEMPE_OK);
        kmp_evaluator *eval = kmp_eval_new(l.system, "tape");
        CHECK(kmp_reduction_init(&red, eval, &check->part) == KEMPE_OK && red.zeros);
        double *qd = KMP_NEW(double, red.n), *udd = KMP_NEW(double, red.p);
        for (int i = 0; i < red.p; i++)
            udd[i] = between(-1, 1);
        kempe_assembly *a = NULL;
        CHECK(kempe_assembly_new(l.system, &a) == KEMPE_OK);
        kmp_eval_closure(eval, 0, a->q);
        CHECK(kmp_reduction_factor(&red) == 0);
        kmp_reduction_tangent(&red);
        kmp_reduction_rates(&red, udd, qd);
        kmp_eval_mass(eval);
        kmp_eval_bias(eval, qd);
        CHECK(kmp_reduction_accelerate(&red, udd) == 0);
        check_accelerations(&red, udd);
        kmp_free(qd);
        kmp_free(udd);
        kempe_assembly_free(a);
        kmp_reduction_free(&red);
        kmp_eval_free(eval);
        kempe_check_free(check);
        unload(&l);
    }
}

int main(void)
{
    TEST(random_matrices_have_their_rank);
    TEST(a_row_adds_what_it_adds_to_all);
    TEST(far_rows_cost_nothing);
    TEST(metres_and_millimetres_agree);
    TEST(the_arithmetic_is_that_counted_by_hand);
    TEST(accelerations_obey_the_whole_equations);
    TEST(a_safe_wish_is_respected);
    TEST(an_unsafe_wish_is_refused);
    TEST(a_wrong_number_of_wishes_is_refused);
    return check_report();
}
