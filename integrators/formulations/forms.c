/* SPDX-License-Identifier: BSD-3-Clause */
/* The dae formulation: forms of one index-reduced DAE in y = (q, v, multipliers), on the independent rows of h:
 *
 *     q' - v [+ J' mu] = 0      M v' + C - J' lambda = 0
 *     one or two groups of  c0 h + c1 (J v + h_t) + c2 hddot = 0
 *
 * - stabilized1: h and J v + h_t with lambda = L', mu = N', derivatives of states: no algebraic unknown is left (Gear,
 *   Gupta and Leimkuhler 1985; Hiller and Anantharaman)
 * - ggl: h and J v + h_t with lambda and mu as algebraic unknowns
 * - index2: J v + h_t = 0; positions drift slowly
 * - index1: hddot + 2 alpha (J v + h_t) + beta^2 h = 0 (Baumgarte 1972), alpha = beta = 10 / characteristic time; by
 *   the integrator radau hddot = 0 with a projection after each step
 * - index3: h = 0, for teaching: accelerations and multipliers lose most digits, and below rtol 1e-10 it fails
 *
 * Rows between rates (kmp_row.of_rates) have no h: where a group has only h, mu = 0 takes its place.
 *
 * Weights exclude multipliers from every error norm: the first steps are tiny, the condition of the iteration matrix
 * grows like h^-(index - 1), and corrections of multipliers never fall below rounding times that condition. */
#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "constraints/evaluation/tangent.h"
#include "integrators/formulations/formulation.h"
#include "linalg/dense/dot.h"
#include "model/data/state.h"
#include <kempe/kempe.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Factor on the error weights of multipliers. At 1e8 the algebraic ones of GGL still stop Newton at rtol 1e-12. */
#define OUT_OF_NORM 1e14
/* Baumgarte's gains in characteristic rates. */
#define BAUMGARTE_GAIN 10.0

typedef struct form {
    bool integrated, mu; /* multipliers are derivatives of states; J' mu corrects q' */
    bool rates_free;     /* v is algebraic: only h = 0 determines it */
    bool baumgarte;      /* group 0 is multiplied by powers of the gain */
    int groups;
    double weight[2][3]; /* of h, J v + h_t, hddot in each group */
} form;

static const form form_stabilized1 = {.integrated = true, .mu = true, .groups = 2, .weight = {{1, 0, 0}, {0, 1, 0}}};
static const form form_ggl = {.mu = true, .groups = 2, .weight = {{1, 0, 0}, {0, 1, 0}}};
static const form form_index2 = {.groups = 1, .weight = {{0, 1, 0}}};
static const form form_index1 = {.baumgarte = true, .groups = 1, .weight = {{1, 2, 1}}};
static const form form_index3 = {.rates_free = true, .groups = 1, .weight = {{1, 0, 0}}};

/* One term of the iteration matrix: adds factor * (cj or 1) * (a tangent output, or 1 when source < 0) to entry
 * `at`. */
typedef struct term {
    long row, col;
    int at, source;
    bool cj;
    double factor;
} term;

typedef struct dae {
    kmp_formulation formulation; /* first */
    form form;
    const kempe_system *s;
    kmp_evaluator *eval;
    kmp_rank_margin *margin;
    const kmp_partition *part;
    kmp_saddle saddle;
    kmp_tangents tangents;
    int n, m, r;
    double tolerance; /* of an angle */
    int *position;    /* m: position of a row among the independent ones, -1 when dropped */
    int64_t *col_start, *row;
    double *differential, *factor;
    term *terms;
    int term_count;
    double *lambda, *mu; /* m: spread over all rows */
} dae;

/* Position of v, whose rows are the equations of motion; of the rows of group g, which belong to lambda (0) and
 * mu (1). */
static int at_v(const dae *d)
{
    return d->n;
}
static int at_group(const dae *d, int g)
{
    return 2 * d->n + g * d->r;
}

/* -- the iteration matrix ----------------------------------------------------------------------------- */

/* Adds a term, or only counts it while there is no room yet. */
static void add_term(dae *d, int row, int col, int source, bool cj, double factor)
{
    if (factor == 0)
        return;
    if (d->terms)
        d->terms[d->term_count] = (term){row, col, 0, source, cj, factor};
    d->term_count++;
}

/* True for a row without h in a group of only h. */
static bool is_without_place(const dae *d, int g, int row)
{
    return d->s->rows[row].of_rates && d->form.weight[g][1] == 0 && d->form.weight[g][2] == 0;
}

/* J is the derivative of h by q, of J v by v, of hddot by v', and transposed the derivative by the multipliers. */
static void add_jacobian(dae *d, const kmp_tangent *e, int at)
{
    bool cj = d->form.integrated;
    add_term(d, at_v(d) + e->col, at_group(d, 0) + at, e->source, cj, -1);
    if (d->form.mu)
        add_term(d, e->col, at_group(d, 1) + at, e->source, cj, 1);
    for (int g = 0; g < d->form.groups; g++) {
        const double *weight = d->form.weight[g];
        int row = at_group(d, g) + at;
        add_term(d, row, e->col, e->source, false, d->s->rows[e->row].of_rates ? 0 : weight[0]);
        add_term(d, row, at_v(d) + e->col, e->source, false, weight[1]);
        add_term(d, row, at_v(d) + e->col, e->source, true, weight[2]);
    }
}

/* Places of blocks: rows of the equations of q (0) or v (1), or closure rows of an order of h; columns of q or v. */
static const struct {
    bool motion, closure;
    int row, col; /* closure: the order of h */
    bool cj;
} places[KMP_TANGENT_BLOCKS] = {
    [KMP_R_Q] = {.motion = true, .row = 1, .col = 0},           [KMP_R_QD] = {.motion = true, .row = 1, .col = 1},
    [KMP_M] = {.motion = true, .row = 1, .col = 1, .cj = true}, [KMP_JTMU_Q] = {.motion = true, .row = 0, .col = 0},
    [KMP_RATE_Q] = {.closure = true, .row = 1, .col = 0},       [KMP_CURVE_Q] = {.closure = true, .row = 2, .col = 0},
    [KMP_CURVE_QD] = {.closure = true, .row = 2, .col = 1}};

static void add_entry(dae *d, const kmp_tangent *e)
{
    int n = d->n, row = places[e->block].row, col = places[e->block].col * n + e->col;
    bool jacobian = e->block == KMP_J, by_lambda = e->block == KMP_C_LAMBDA;
    int at = jacobian || places[e->block].closure ? d->position[e->row] : by_lambda ? d->position[e->col] : 0;
    if (at < 0) /* the row is dropped */
        return;
    if (jacobian)
        add_jacobian(d, e, at);
    if (by_lambda)
        add_term(d, at_v(d) + e->row, at_group(d, 0) + at, e->source, d->form.integrated, 1);
    if (places[e->block].motion)
        add_term(d, row * n + e->row, col, e->source, places[e->block].cj, 1);
    for (int g = 0; places[e->block].closure && g < d->form.groups; g++)
        add_term(d, at_group(d, g) + at, col, e->source, false, d->form.weight[g][row]);
}

static void add_terms(dae *d)
{
    d->term_count = 0;
    for (int k = 0; k < d->n; k++) {
        add_term(d, k, k, -1, true, 1);
        add_term(d, k, at_v(d) + k, -1, false, -1);
    }
    for (int k = 0; k < d->tangents.start[KMP_TANGENT_BLOCKS]; k++)
        add_entry(d, &d->tangents.entry[k]);
    for (int i = 0; i < d->r; i++)
        for (int g = 0; g < d->form.groups; g++)
            if (is_without_place(d, g, d->part->rows[i]))
                add_term(d, at_group(d, g) + i, at_group(d, 1) + i, -1, d->form.integrated, 1);
}

static int by_column(const void *a, const void *b)
{
    const term *x = a, *y = b;
    if (x->col != y->col)
        return x->col < y->col ? -1 : 1;
    if (x->row != y->row)
        return x->row < y->row ? -1 : 1;
    return x->source != y->source ? x->source - y->source : x->cj - y->cj;
}

/* Makes all terms, and compressed columns of their union. false: no memory. */
static bool compress(dae *d)
{
    int size = d->formulation.size, nz = 0;
    add_terms(d);
    if (!KMP_ARENA_MAKE(&d->formulation.arena, KMP_ROOM(term, d->term_count, &d->terms),
                        KMP_ROOM(int64_t, size + 1, &d->col_start), KMP_ROOM(int64_t, d->term_count, &d->row)))
        return false;
    add_terms(d);
    qsort(d->terms, (size_t)d->term_count, sizeof *d->terms, by_column);
    for (int k = 0; k < d->term_count; k++) {
        term *t = &d->terms[k];
        bool again = k > 0 && t[-1].col == t->col && t[-1].row == t->row;
        t->at = again ? nz - 1 : nz++;
        d->row[t->at] = t->row;
        d->col_start[t->col + 1] = nz;
    }
    for (int c = 1; c <= size; c++)
        if (d->col_start[c] == 0)
            d->col_start[c] = d->col_start[c - 1];
    d->formulation.dae.nz = nz;
    return true;
}

/* -- the DAE ----------------------------------------------------------------------------------------- */

static kmp_instant instant(dae *d, double t, const double *y, const double *yp)
{
    const double *multipliers = d->form.integrated ? yp : y;
    for (int i = 0; i < d->r; i++) {
        d->lambda[d->part->rows[i]] = multipliers[at_group(d, 0) + i];
        if (d->form.mu)
            d->mu[d->part->rows[i]] = multipliers[at_group(d, 1) + i];
    }
    kmp_instant at = kmp_instant_of(d->eval, t, y, y + at_v(d), yp + at_v(d), d->lambda);
    at.mu = d->form.mu ? d->mu : NULL;
    return at;
}

/* Values of h and its derivatives by time, by their order. */
static const kmp_value closure_value[3] = {KMP_VALUE_H, KMP_VALUE_RATE, KMP_VALUE_CURVE};

/* Adds the rows of group g of `out`. */
static void put_group(const dae *d, const double *out, int g, double *r)
{
    const int *row = d->part->rows;
    bool first = true;
    for (int order = 0; order < 3; order++) {
        const double weight = d->form.weight[g][order], *value = out + d->tangents.at[closure_value[order]];
        if (weight == 0)
            continue;
        for (int i = 0; i < d->r; i++)
            r[i] = weight * value[row[i]] + (first ? 0 : r[i]);
        first = false;
    }
    for (int i = 0; i < d->r; i++)
        if (is_without_place(d, g, row[i]))
            r[i] = d->mu[row[i]];
}

static int residual(void *self, double t, const double *y, const double *yp, double *r)
{
    dae *d = self;
    int n = d->n;
    kmp_instant at = instant(d, t, y, yp);
    const double *out = kmp_tangents_values(&d->tangents, &at), *qd = y + n;
    for (int i = 0; i < n; i++)
        r[i] = yp[i] - qd[i];
    for (int i = 0; d->form.mu && i < n; i++)
        r[i] += out[d->tangents.at[KMP_VALUE_JTMU] + i];
    memcpy(r + n, out + d->tangents.at[KMP_VALUE_R], (size_t)n * sizeof *r);
    for (int g = 0; g < d->form.groups; g++)
        put_group(d, out, g, r + at_group(d, g));
    return kmp_all_finite(d->formulation.size, r) ? KMP_GO : KMP_RETRY;
}

static int matrix(void *self, double t, double cj, const double *y, const double *yp, double *values)
{
    dae *d = self;
    kmp_instant at = instant(d, t, y, yp);
    const double *out = kmp_tangents_derivatives(&d->tangents, &at);
    memset(values, 0, (size_t)d->formulation.dae.nz * sizeof *values);
    for (int k = 0; k < d->term_count; k++) {
        const term *e = &d->terms[k];
        values[e->at] += e->factor * (e->cj ? cj : 1) * (e->source >= 0 ? out[e->source] : 1);
    }
    return KMP_GO;
}

static int accept(void *self, double t, const double *y, const double *yp)
{
    dae *d = self;
    (void)yp;
    if (kmp_rank_margin_unwatched(d->margin))
        return KMP_GO;
    kmp_eval_closure(d->eval, t, y);
    int said = kmp_redundant_check(d->eval, d->part, t, d->tolerance, &d->formulation.reason);
    return said == KMP_GO && kmp_rank_margin_refuses(d->margin, d->eval, t) ? KMP_RETRY : said;
}

/* A row has q and qd of the integrator; accelerations and multipliers come from the saddle system there. */
static int row(kmp_formulation *formulation, double t, const double *y, double *q, double *qd, double *qdd,
               double *lambda, double *work)
{
    dae *d = (dae *)formulation;
    memcpy(q, y, (size_t)d->n * sizeof *q);
    *work = 0;
    if (qd)
        memcpy(qd, y + d->n, (size_t)d->n * sizeof *qd);
    if (!qdd)
        return KMP_GO;
    kmp_eval_closure(d->eval, t, q);
    kmp_eval_mass(d->eval);
    kmp_eval_bias(d->eval, qd);
    if (kmp_saddle_factor(&d->saddle)) {
        kmp_text_printf(&formulation->reason,
                        "accelerations and multipliers are not unique at the output time t = %.9g s: the mechanism is "
                        "singular there",
                        t);
        return KMP_HALT;
    }
    kmp_saddle_accelerations(&d->saddle, qdd, lambda);
    return KMP_GO;
}

/* Puts lambda (m) into the unknowns, with mu = 0. */
static void put_multipliers(const dae *d, const double *lambda, double *y, double *yp)
{
    double *multipliers = d->form.integrated ? yp : y;
    for (int i = 0; i < d->r; i++) {
        multipliers[at_group(d, 0) + i] = lambda[d->part->rows[i]];
        if (d->form.mu)
            multipliers[at_group(d, 1) + i] = 0;
    }
}

static int resume(kmp_formulation *formulation, double t, const double *q, const double *qd, double *y, double *yp)
{
    dae *d = (dae *)formulation;
    int n = d->n;
    memcpy(y, q, (size_t)n * sizeof *y);
    memcpy(y + n, qd, (size_t)n * sizeof *y);
    /* Closes them along the mass-orthogonal direction, then computes accelerations and multipliers. */
    const kmp_closer closer = kmp_saddle_closer(&d->saddle, yp + n);
    if (!kmp_close_state(&closer, d->mu, t, y, y + n))
        return KMP_HALT;
    memset(d->mu, 0, (size_t)d->m * sizeof *d->mu);
    kmp_eval_bias(d->eval, y + n);
    kmp_saddle_accelerations(&d->saddle, yp + n, d->lambda);
    memcpy(yp, y + n, (size_t)n * sizeof *y);
    put_multipliers(d, d->lambda, y, yp);
    return KMP_GO;
}

/* -- making one -------------------------------------------------------------------------------------- */

static void release(kmp_formulation *formulation)
{
    dae *d = (dae *)formulation;
    kmp_saddle_free(&d->saddle);
    kmp_tangents_free(&d->tangents);
    kmp_formulation_free(formulation);
}

static kempe_status prepare(dae *d, const form *chosen, const kmp_formulation_start *start)
{
    int size = 2 * d->n + chosen->groups * d->r;
    kmp_formulation_make_unknowns(&d->formulation, size, true);
    bool made = KMP_ARENA_MAKE(&d->formulation.arena, KMP_ROOM(double, size, &d->differential, &d->factor),
                               KMP_ROOM(double, d->m, &d->lambda, &d->mu), KMP_ROOM(int, d->m, &d->position));
    KMP_TRY(kmp_made(d->s->context, made && kmp_saddle_init(&d->saddle, d->eval, d->part)));
    /* Weights of the form's groups, scaled for Baumgarte's method. */
    double rate_scale = start->rate_scale;
    double gain = chosen->baumgarte ? BAUMGARTE_GAIN * rate_scale : 1;
    d->form = *chosen;
    for (int g = 0; g < 2; g++) {
        d->form.weight[g][0] *= gain * gain;
        d->form.weight[g][1] *= gain;
    }
    for (int i = 0; i < d->m; i++)
        d->position[i] = -1;
    for (int i = 0; i < d->r; i++)
        d->position[d->part->rows[i]] = i;
    const char *row = chosen->rates_free ? kmp_formulation_row_of_rates(d->s) : NULL;
    if (row)
        return kmp_fail(d->s->context, KEMPE_E_INPUT,
                        "form index3 has position constraints only, and '%s' is a nonholonomic constraint; use another "
                        "form, as stabilized1",
                        row);
    unsigned values = 1u << KMP_VALUE_R | (chosen->mu ? 1u << KMP_VALUE_JTMU : 0) | KMP_TANGENTS_WITH_VALUES;
    for (int g = 0; g < chosen->groups; g++)
        for (int order = 0; order < 3; order++)
            values |= chosen->weight[g][order] != 0 ? 1u << closure_value[order] : 0;
    KMP_TRY(kmp_tangents_init(&d->tangents, d->s, d->eval->backend, values));
    KMP_TRY(kmp_tangents_add_values(&d->tangents, d->s, d->eval->backend));
    KMP_TRY(kmp_made(d->s->context, compress(d)));
    /* The state at the start, and its tolerances. */
    int n = d->n;
    kmp_formulation_begin_with_state(&d->formulation, start);
    memcpy(d->formulation.yp, start->qd, (size_t)n * sizeof *d->formulation.yp);
    memcpy(d->formulation.yp + n, start->qdd, (size_t)n * sizeof *d->formulation.yp);
    put_multipliers(d, start->lambda, d->formulation.y, d->formulation.yp);
    for (int i = 0; i < d->formulation.size; i++) {
        bool coordinate = i < n, rate = i >= n && i < 2 * n;
        bool state = rate && kmp_state_of(d->s->model, i - n);
        d->differential[i] = coordinate || (rate && !d->form.rates_free) || state || d->form.integrated;
        d->factor[i] = coordinate || rate ? 1 : OUT_OF_NORM;
        if (!coordinate && !rate)
            d->formulation.atol[i] = start->atol;
    }
    return KEMPE_OK;
}

/* Solved for accelerations and multipliers at every stage, the equations are the equations of the projected
 * formulation. */
static kmp_formulation *create(const kmp_formulation_kind *kind, const kmp_formulation_start *start)
{
    if (!start->dae)
        return kmp_formulation_projected.create(&kmp_formulation_projected, start);
    dae *d = kmp_formulation_new(start, sizeof *d);
    if (!d)
        return NULL;
    d->s = start->system;
    d->eval = start->eval;
    d->margin = start->margin;
    d->part = start->part;
    d->n = start->part->n;
    d->m = start->part->m;
    d->tolerance = start->atol + start->rtol;
    d->r = start->part->r;
    d->formulation.release = release;
    d->formulation.row = row;
    d->formulation.position = kmp_formulation_position_of_state;
    d->formulation.resume = resume;
    if (prepare(d, kind->detail, start) != KEMPE_OK) {
        release(&d->formulation);
        return NULL;
    }
    d->formulation.dae = (kmp_dae){.n = d->formulation.size,
                                   .nz = d->formulation.dae.nz,
                                   .col_start = d->col_start,
                                   .row = d->row,
                                   .differential = d->differential,
                                   .factor = d->factor,
                                   .self = d,
                                   .residual = residual,
                                   .matrix = matrix,
                                   .accept = accept};
    return &d->formulation;
}

#define FORM(id, is_standard, is_solved)                                                                               \
    const kmp_formulation_kind kmp_formulation_##id = {.formulation = "dae",                                           \
                                                       .form = #id,                                                    \
                                                       .dae = true,                                                    \
                                                       .standard = is_standard,                                        \
                                                       .solved = is_solved,                                            \
                                                       .lanes_first = is_solved,                                       \
                                                       .by_bodies = is_solved,                                         \
                                                       .by_products = is_solved,                                       \
                                                       .detail = &form_##id,                                           \
                                                       .create = create}

FORM(stabilized1, true, false);
FORM(ggl, false, false);
FORM(index2, false, false);
FORM(index1, false, true);
FORM(index3, false, false);
