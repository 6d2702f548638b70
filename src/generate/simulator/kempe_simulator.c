/* SPDX-License-Identifier: BSD-3-Clause */
/* The simulator of kempe_simulator.h. An ordinary differential equation for y = (u, ud, v): independent coordinates,
 * their rates, dependent coordinates. Within a step v is integrated by its rate, which is exact; at the end of each
 * step, and for each output, Newton's method closes the loops, and u and ud alone count. A correction beyond the error
 * weights rejects the step.
 *
 * A step is a function of the state at its beginning alone. Outputs within it are its dense output with loops closed.
 * Changes at the end of a step, of modes or of the choice of coordinates, are made at the beginning of the next one. So
 * the coordinates and modes of a step are those of its dense output. */
#include "kempe_simulator.h"
#include "base/bracket.h"
#include "integrators/steppers/explicit_methods.h"
#include "linalg/dense/factors.h"

#include <stdio.h>
#include <string.h>

enum { MOST_CLOSINGS = 12, MOST_LOADS = 50, MOST_ATTEMPTS = 1000, MOST_PASSES = 20, MOST_PARTS = 256, SAMPLES = 4 };

/* Scaled numbers; each means the same as in the library. */
#define CLOSED_ENOUGH        1e-11 /* largest h where rounding stops the corrections */
#define LONGEST_CORRECTION   0.5   /* of a coordinate, rad or characteristic lengths */
#define TRUSTED_CORRECTION   0.1   /* a longer one comes from a distant guess: it is approached in parts */
#define CORRECTION_LIMIT     1.0   /* of v at the end of a step, in error weights; with redundant rows REDUNDANT */
#define CORRECTION_REDUNDANT 3e-3
#define CORRECTION_ROUNDING  1e-13
#define GROWTH               1.5 /* of dependent coordinates over independent ones: above it both are exchanged */
#define GROWTH_OF_CALLERS    3.0 /* the same where each exchange restarts an integrator of the caller */
#define ROWS_OUT             2.0 /* share of a row in a redundant one above which rows are chosen anew */
#define DROPPED_WEIGHTS      1e3 /* tolerances by which a redundant row may open; or OVER times its opening at the start */
#define DROPPED_START        1e-4
#define DROPPED_OVER         30.0
#define UNCONTROLLED         1e300
#define LOADS_SETTLED        1e-14 /* relative change of multipliers at which C is at them; where rounding stops it */
#define LOADS_ROUNDED        1e-9
#define NO_MASS              1e-13 /* pivot of the reduced mass over its diagonal */
#define JUMP                 1e-9  /* of rates where modes change, over the fastest one */
#define INSTANT              1e-11 /* of the time of the motion: events within it are at one time */

/* Places in the header of the state. */
enum {
    AT_T,
    AT_BEGIN, /* of the last step, from which its dense output counts */
    AT_END,   /* of the last step, or an event within it */
    AT_TAKEN, /* length of the step that was made; 0: none */
    AT_METHOD_TAKEN,
    AT_NEXT,
    AT_ERROR,
    AT_REJECTED,
    AT_HOPELESS,
    AT_DENSE,    /* vectors of the dense output are there */
    AT_FRESH,    /* the derivative at the end is not there */
    AT_EVENT,    /* modes change at the end, by `flip` */
    AT_EXCHANGE, /* the choice is bad at the end */
    AT_ENDED,    /* 1 + the condition that ends the motion at the end; 0 */
    AT_SIGN,     /* of det Jv, block by block */
    AT_RATE,     /* of the motion at the start, 1/s */
    AT_LOOSE,    /* largest h of a redundant row at the start */
    AT_STARTED,
    AT_BAD, /* the choice is bad at the present state for an integrator of the caller */
    AT_METHOD,
    AT_RTOL,
    AT_ATOL,
    AT_FIXED,
    AT_LONGEST,
    AT_LAST,
    AT_MOST,
    AT_STEPS,
    AT_REFUSED,
    AT_EVALUATIONS,
    AT_CLOSINGS,
    AT_EXCHANGES,
    AT_EVENTS,
    HEADER = 48
};

/* Results of an evaluation. */
typedef enum outcome { GOOD, OPEN, SINGULAR_LOOPS, SINGULAR_MASS, NOT_FINITE, UNSETTLED } outcome;

static const kmp_rk_numbers methods[] = {KMP_DOP853_NUMBERS, KMP_DOPRI5_NUMBERS};

/* -- memory -------------------------------------------------------------------------------------------- */

static double *take(double **at, int count)
{
    double *array = *at;
    *at += count;
    return array;
}

/* Indices lie in places of doubles that nothing else uses. */
static int *take_indices(double **at, int count)
{
    return (int *)(void *)take(at, count);
}

static int rank_of(const kempe_equations *e)
{
    return e->coordinates - e->freedom;
}

static int size_of_y(const kempe_equations *e)
{
    return e->coordinates + e->freedom;
}

static void place_state(kempe_simulator *s, double **at)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows, size = size_of_y(e);
    part->state = take(at, HEADER);
    s->p = take(at, e->parameters);
    s->u = take(at, 3 * e->inputs);
    part->held = take(at, 3 * e->inputs);
    part->k = take(at, e->kept);
    s->q = take(at, n);
    s->qd = take(at, n);
    s->qdd = take(at, n);
    s->lambda = take(at, m);
    s->y = take(at, e->outputs);
    part->modes = take(at, e->conditions);
    part->value = take(at, e->conditions);
    part->flip = take(at, e->conditions);
    part->last = take(at, e->conditions);
    part->repeats = take(at, e->conditions);
    part->begin = take(at, 3 * n + m);
    part->end = take(at, 3 * n + m);
    part->y_old = take(at, size);
    part->y_new = take(at, size);
    part->weight = take(at, size);
    part->atol = take(at, size);
    part->stages = take(at, KMP_RK_MAX_STAGES * size);
    part->vectors = take(at, KMP_RK_MAX_INTERPOLANTS * size);
    part->row = take_indices(at, m);
    part->column = take_indices(at, n);
}

static void place_equations(kempe_simulator *s, double **at)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows, f = e->freedom, r = rank_of(e);
    part->q = take(at, n);
    part->qd = take(at, n);
    part->qdd = take(at, n);
    part->lambda = take(at, m);
    part->changes = take(at, (SAMPLES + 3) * e->conditions);
    part->h = take(at, m);
    part->h_t = take(at, m);
    part->jdqd = take(at, m);
    part->jacobian = take(at, m * n);
    part->mass = take(at, n * n);
    part->bias = take(at, n);
    part->loop = take(at, r * r);
    part->tangent = take(at, r * (f + 1));
    part->constant = take(at, r);
    part->correction = take(at, r);
    part->moved = take(at, n * f);
    part->reduced = take(at, f * f);
    part->diagonal = take(at, f);
    part->udd = take(at, f);
    part->load = take(at, n);
    part->pick = take(at, m * n);
    part->pivots = take(at, m);
    part->loads = take(at, n * r);
    part->joint = take(at, n * n);
    part->right = take(at, n);
    part->inverse_row = take(at, m);
    part->pivot = take_indices(at, n);
    part->joint_pivot = take_indices(at, n);
    part->new_row = take_indices(at, m);
    part->new_column = take_indices(at, n);
    part->fixed = take_indices(at, n);
    part->block = take_indices(at, n + 1);
    part->touch_begin = take_indices(at, f + 1);
    part->touch = take_indices(at, f * r);
    part->mass_begin = take_indices(at, n + 1);
    part->mass_at = take_indices(at, n * n);
    part->row_mark = take_indices(at, m);
    part->column_mark = take_indices(at, n);
}

static void place_directions(kempe_simulator *s, double **at)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows;
    part->dq = take(at, n);
    part->dqd = take(at, n);
    part->dqdd = take(at, n);
    part->dlambda = take(at, m);
    part->dynamics = take(at, n);
    part->dh = take(at, m);
    part->drates = take(at, m);
    part->daccelerations = take(at, m);
    part->dy = take(at, e->outputs);
    part->dvalue = take(at, e->conditions);
    part->zero = take(at, e->parameters + 3 * e->inputs);
}

int kempe_simulator_memory(const kempe_equations *e)
{
    return KEMPE_SIMULATOR_MEMORY(e->coordinates, e->rows, e->freedom, e->inputs, e->parameters, e->kept, e->conditions,
                                  e->outputs);
}

int kempe_simulator_saved_numbers(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    return KEMPE_SIMULATOR_STATE(e->coordinates, e->rows, e->freedom, e->inputs, e->parameters, e->kept, e->conditions,
                                 e->outputs);
}

static void copy(int count, const double *from, double *to)
{
    if (count > 0)
        memcpy(to, from, (size_t)count * sizeof *to);
}

static void clear(int count, double *x)
{
    for (int i = 0; i < count; i++)
        x[i] = 0;
}

static void list_mass(kempe_simulator *s);
static void find_structure(kempe_simulator *s);

void kempe_simulator_init(kempe_simulator *s, const kempe_equations *e, double *memory)
{
    memset(s, 0, sizeof *s);
    s->equations = e;
    s->memory = memory;
    s->numbers = kempe_simulator_memory(e);
    memset(memory, 0, (size_t)s->numbers * sizeof *memory);
    double *at = memory;
    place_state(s, &at);
    s->part.backup = take(&at, kempe_simulator_saved_numbers(s));
    s->part.scratch = take(&at, 1);
    s->part.x = take(&at, 2 * e->freedom);
    s->part.rates = take(&at, 2 * e->freedom);
    s->part.stage = take(&at, size_of_y(e));
    s->part.candidate = take(&at, size_of_y(e));
    s->part.probe = take(&at, size_of_y(e));
    place_equations(s, &at);
    place_directions(s, &at);
    s->part.end_of_memory = at;
    s->settings.method = KEMPE_METHOD_DOP853;
    s->settings.rtol = s->settings.atol = 1e-8;
    s->settings.end = INFINITY;
    copy(e->parameters, e->parameter_values, s->p);
    copy(3 * e->inputs, e->input_values, s->u);
    copy(3 * e->inputs, s->u, s->part.held);
    for (int i = 0; i < e->rows; i++)
        s->part.inverse_row[i] = 1 / e->row_scale[i];
    if (e->prepare)
        e->prepare(s->p, s->part.k);
    for (int i = 0; i < e->rows; i++)
        s->part.row[i] = i;
    for (int j = 0; j < e->coordinates; j++)
        s->part.column[j] = j;
    list_mass(s);
    find_structure(s);
}

/* Settings, time and work, which are members, as numbers of the state. */
static void pack(const kempe_simulator *s, double *state)
{
    state[AT_T] = s->t;
    state[AT_METHOD] = (double)s->settings.method;
    state[AT_RTOL] = s->settings.rtol;
    state[AT_ATOL] = s->settings.atol;
    state[AT_FIXED] = s->settings.fixed_step;
    state[AT_LONGEST] = s->settings.longest;
    state[AT_LAST] = s->settings.end;
    state[AT_MOST] = s->settings.most_steps;
    state[AT_STEPS] = s->work.steps;
    state[AT_REFUSED] = s->work.rejected;
    state[AT_EVALUATIONS] = s->work.evaluations;
    state[AT_CLOSINGS] = s->work.closings;
    state[AT_EXCHANGES] = s->work.exchanges;
    state[AT_EVENTS] = s->work.events;
}

static void unpack(kempe_simulator *s, const double *state)
{
    s->t = state[AT_T];
    s->settings.method = (kempe_simulator_method)(int)state[AT_METHOD];
    s->settings.rtol = state[AT_RTOL];
    s->settings.atol = state[AT_ATOL];
    s->settings.fixed_step = state[AT_FIXED];
    s->settings.longest = state[AT_LONGEST];
    s->settings.end = state[AT_LAST];
    s->settings.most_steps = state[AT_MOST];
    s->work.steps = state[AT_STEPS];
    s->work.rejected = state[AT_REFUSED];
    s->work.evaluations = state[AT_EVALUATIONS];
    s->work.closings = state[AT_CLOSINGS];
    s->work.exchanges = state[AT_EXCHANGES];
    s->work.events = state[AT_EVENTS];
}

/* The factors in the scratch are those of the present state. */
static double *factors_are_present(kempe_simulator *s)
{
    return s->part.scratch;
}

void kempe_simulator_save(const kempe_simulator *s, double *to)
{
    copy(kempe_simulator_saved_numbers(s), s->part.state, to);
    pack(s, to);
}

/* Except for the message. */
static void put_back(kempe_simulator *s, const double *from)
{
    copy(kempe_simulator_saved_numbers(s), from, s->part.state);
    unpack(s, s->part.state);
    *factors_are_present(s) = 0;
    find_structure(s);
}

void kempe_simulator_restore(kempe_simulator *s, const double *from)
{
    put_back(s, from);
    s->message[0] = 0;
    const kempe_equations *e = s->equations;
    for (int k = 0; k < e->freedom; k++) {
        int c = s->part.column[rank_of(e) + k];
        s->part.x[k] = s->q[c];
        s->part.x[e->freedom + k] = s->part.rates[k] = s->qd[c];
        s->part.rates[e->freedom + k] = s->qdd[c];
    }
}

/* -- structure ----------------------------------------------------------------------------------------- */

static bool can_be_nonzero(const char *const *zeros, int row, int column)
{
    return !zeros || zeros[row][column] != '0';
}

static void list_mass(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int count = 0;
    for (int i = 0; i < e->coordinates; i++) {
        part->mass_begin[i] = count;
        for (int j = 0; j < e->coordinates; j++)
            if (can_be_nonzero(e->mass_zeros, i, j))
                part->mass_at[count++] = j;
    }
    part->mass_begin[e->coordinates] = count;
}

/* Marks rows and columns of Jv that are connected by entries with the least index of their rows. */
static void mark_loops(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int r = rank_of(e);
    for (int i = 0; i < r; i++) {
        part->row_mark[i] = i;
        part->column_mark[i] = r;
    }
    for (bool changed = true; changed;) {
        changed = false;
        for (int i = 0; i < r; i++)
            for (int k = 0; k < r; k++) {
                int *row = &part->row_mark[i], *column = &part->column_mark[k];
                if (*row == *column || !can_be_nonzero(e->jacobian_zeros, part->row[i], part->column[k]))
                    continue;
                *row = *column = *row < *column ? *row : *column;
                changed = true;
            }
    }
}

/* Sorts indices by their marks, equal ones in their order. */
static void sort_by_marks(int count, int *mark, int *index)
{
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0 && mark[j - 1] > mark[j]; j--) {
            kmp_swap_int(&mark[j - 1], &mark[j]);
            kmp_swap_int(&index[j - 1], &index[j]);
        }
}

/* Blocks of the sorted choice; 1 where rows and columns of a block differ in number. */
static int count_blocks(struct kempe_simulator_parts *part, int r)
{
    int blocks = 0;
    for (int i = 0; i < r; i++) {
        if (part->row_mark[i] != part->column_mark[i])
            return 1;
        if (i == 0 || part->row_mark[i] != part->row_mark[i - 1])
            part->block[blocks++] = i;
    }
    return blocks;
}

/* Orders the choice by loops that have no coordinate in common: blocks of Jv, one after another. Lists the blocks that
 * move with each independent coordinate. The order depends on the choice alone. */
static void find_structure(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e), count = 0;
    mark_loops(s);
    sort_by_marks(r, part->row_mark, part->row);
    sort_by_marks(r, part->column_mark, part->column);
    part->block[0] = 0;
    part->blocks = count_blocks(part, r);
    part->block[part->blocks] = r;
    clear(r * (f + 1), part->tangent);
    for (int k = 0; k < f; k++) {
        part->touch_begin[k] = count;
        for (int b = 0; b < part->blocks; b++) {
            bool touches = false;
            for (int i = part->block[b]; i < part->block[b + 1]; i++)
                touches = touches || can_be_nonzero(e->jacobian_zeros, part->row[i], part->column[r + k]);
            if (touches)
                part->touch[count++] = b;
        }
    }
    part->touch_begin[f] = count;
}

/* -- loops --------------------------------------------------------------------------------------------- */

static kempe_arguments arguments_at(const kempe_simulator *s, double t)
{
    const struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = {t, part->k, part->q, part->qd, part->qdd, part->lambda, part->modes, part->held};
    return at;
}

/* Evaluates h, J and h_t at the placed q and factors Jv, whose rows are scaled: scaled columns have the same pivots. */
static outcome evaluate_loops(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates;
    *factors_are_present(s) = 0;
    if (e->rows == 0)
        return GOOD;
    kempe_arguments at = arguments_at(s, t);
    e->closures(&at, part->h, part->jacobian, part->h_t);
    s->work.closings++;
    double *loop = part->loop;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        const int *column = part->column + from;
        for (int i = 0; i < count; i++) {
            const double *row = part->jacobian + (ptrdiff_t)part->row[from + i] * n;
            double size = part->inverse_row[part->row[from + i]];
            for (int k = 0; k < count; k++)
                loop[i + k * count] = row[column[k]] * size;
        }
        if (kmp_lu_factor(count, loop, part->pivot + from))
            return SINGULAR_LOOPS;
        loop += (ptrdiff_t)count * count;
    }
    return GOOD;
}

/* x <- Jv^-1 x and x <- Jv^-T x, by the factors, whose rows are scaled. */
static void solve_loops(const kempe_simulator *s, double *x)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double *loop = part->loop;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        kmp_lu_solve(count, loop, part->pivot + from, 1, x + from);
        loop += (ptrdiff_t)count * count;
    }
}

static void solve_loops_transposed(const kempe_simulator *s, double *x)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double *loop = part->loop;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        kmp_lu_solve_transposed(count, loop, part->pivot + from, x + from);
        loop += (ptrdiff_t)count * count;
    }
}

/* x = -Jv^-1 of rows; `rows` has all m. */
static void solve_rows(const kempe_simulator *s, const double *rows, double *x)
{
    const struct kempe_simulator_parts *part = &s->part;
    for (int i = 0; i < rank_of(s->equations); i++)
        x[i] = -rows[part->row[i]] * part->inverse_row[part->row[i]];
    solve_loops(s, x);
}

static double opening(const kempe_simulator *s, int row)
{
    return fabs(s->part.h[row]) * s->part.inverse_row[row];
}

/* The largest h of the rows that are kept, scaled; infinite where one is not finite. */
static double residual(const kempe_simulator *s)
{
    double worst = 0;
    for (int i = 0; i < rank_of(s->equations); i++) {
        double open = opening(s, s->part.row[i]);
        worst = open <= worst ? worst : open <= DBL_MAX ? open : INFINITY;
    }
    return worst;
}

/* The largest of the scaled correction; infinite where one is not finite. */
static double correction_size(const kempe_simulator *s)
{
    double size = 0;
    for (int i = 0; i < rank_of(s->equations); i++) {
        double d = fabs(s->part.correction[i]) / s->equations->scale[s->part.column[i]];
        size = d <= size ? size : d <= DBL_MAX ? d : INFINITY;
    }
    return size;
}

static double rounding_of_v(const kempe_simulator *s)
{
    double size = 1;
    for (int i = 0; i < rank_of(s->equations); i++)
        size = fmax(size, fabs(s->part.q[s->part.column[i]]) / s->equations->scale[s->part.column[i]]);
    return 16 * DBL_EPSILON * size;
}

static void correct(kempe_simulator *s, double part_of_it)
{
    const struct kempe_simulator_parts *part = &s->part;
    for (int i = 0; i < rank_of(s->equations); i++)
        part->q[part->column[i]] += part_of_it * part->correction[i];
}

/* Closes the loops by Newton's method on v at the placed q; leaves J and its factors there. *first: the size of the
 * first correction (may be NULL). */
static outcome close_loops(kempe_simulator *s, double t, double *first)
{
    double last = INFINITY, rounding = rounding_of_v(s);
    for (int pass = 0; pass < MOST_CLOSINGS; pass++) {
        if (evaluate_loops(s, t) != GOOD)
            return SINGULAR_LOOPS;
        solve_rows(s, s->part.h, s->part.correction);
        double size = correction_size(s), cut = size > LONGEST_CORRECTION ? LONGEST_CORRECTION / size : 1;
        if (pass == 0 && first)
            *first = size;
        if (!(size <= DBL_MAX))
            return OPEN;
        if (size <= rounding || size > 0.9 * last) {
            if (size <= rounding)
                correct(s, 1);
            return size <= rounding || residual(s) <= CLOSED_ENOUGH ? GOOD : OPEN;
        }
        correct(s, cut);
        last = cut < 1 ? INFINITY : size;
    }
    return OPEN;
}

/* Column k of B = -Jv^-1 Ju, of the loops that move with its coordinate; adds what they gain by its rate to vd. */
static void evaluate_tangent(kempe_simulator *s, int k, double *restrict vd)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, r = rank_of(e), at = part->column[r + k], block = 0;
    double *restrict x = part->tangent + (ptrdiff_t)k * r, rate = part->qd[at];
    const double *loop = part->loop;
    for (int t = part->touch_begin[k]; t < part->touch_begin[k + 1]; t++) {
        for (; block < part->touch[t]; block++)
            loop += (ptrdiff_t)(part->block[block + 1] - part->block[block]) *
                    (part->block[block + 1] - part->block[block]);
        int from = part->block[block], end = part->block[block + 1];
        for (int i = from; i < end; i++)
            x[i] = -part->jacobian[(ptrdiff_t)part->row[i] * n + at] * part->inverse_row[part->row[i]];
        kmp_lu_solve(end - from, loop, part->pivot + from, 1, x + from);
        for (int i = from; i < end; i++)
            vd[i] += x[i] * rate;
    }
}

/* B, and vd = B ud - Jv^-1 h_t into the placed qd, which has ud. */
static void evaluate_rates(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    double *vd = part->tangent + (ptrdiff_t)f * r;
    bool moves = false;
    for (int i = 0; i < r; i++) {
        vd[i] = -part->h_t[part->row[i]] * part->inverse_row[part->row[i]];
        moves = moves || vd[i] != 0;
    }
    if (moves)
        solve_loops(s, vd);
    for (int k = 0; k < f; k++)
        evaluate_tangent(s, k, vd);
    for (int i = 0; i < r; i++)
        part->qd[part->column[i]] = vd[i];
}

/* The largest |B| in scaled coordinates. */
static double growth(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int r = rank_of(e);
    double most = 0;
    for (int k = 0; k < e->freedom; k++) {
        double size = e->scale[part->column[r + k]];
        for (int i = 0; i < r; i++)
            most = fmax(most, fabs(part->tangent[k * r + i]) * size / e->scale[part->column[i]]);
    }
    return most;
}

/* The largest share of a kept row in a redundant one, scaled. */
static double share_of_rows(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, r = rank_of(e);
    double most = 0;
    for (int i = r; i < e->rows; i++) {
        const double *row = part->jacobian + (ptrdiff_t)part->row[i] * n;
        for (int k = 0; k < r; k++)
            part->correction[k] = row[part->column[k]] * part->inverse_row[part->row[i]];
        solve_loops_transposed(s, part->correction);
        for (int k = 0; k < r; k++)
            most = fmax(most, fabs(part->correction[k]));
    }
    return most;
}

/* The signs of the determinants of the blocks of Jv, as bits of a number; where there are many, of the last ones. */
static double signs_of_loops(const kempe_simulator *s)
{
    const struct kempe_simulator_parts *part = &s->part;
    const double *loop = part->loop;
    double signs = 1;
    for (int b = 0; b < part->blocks; b++) {
        int from = part->block[b], count = part->block[b + 1] - from;
        int negative = 0;
        for (int i = 0; i < count; i++)
            negative ^= (loop[i + i * count] < 0) ^ (part->pivot[from + i] != i);
        signs = fmod(2 * signs + negative, 0x1p50);
        loop += (ptrdiff_t)count * count;
    }
    return signs;
}

/* -- dynamics ------------------------------------------------------------------------------------------ */

/* x += sum over v of b M, for b of dependent coordinates from `from` to `end`. */
static void add_moved(const kempe_simulator *s, int from, int end, const double *b, double *restrict x)
{
    const struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates;
    for (int i = from; i < end; i++) {
        const double *row = part->mass + (ptrdiff_t)part->column[i] * n;
        double factor = b[i];
        for (int at = part->mass_begin[part->column[i]]; at < part->mass_begin[part->column[i] + 1]; at++)
            x[part->mass_at[at]] += factor * row[part->mass_at[at]];
    }
}

/* Row k of T' c. */
static double project_on(const kempe_simulator *s, int k, const double *c)
{
    int r = rank_of(s->equations);
    const double *b = s->part.tangent + (ptrdiff_t)k * r;
    const int *column = s->part.column, *block = s->part.block;
    double sum = c[column[r + k]];
    for (int t = s->part.touch_begin[k]; t < s->part.touch_begin[k + 1]; t++)
        for (int i = block[s->part.touch[t]]; i < block[s->part.touch[t] + 1]; i++)
            sum += b[i] * c[column[i]];
    return sum;
}

/* T' c. */
static void project(const kempe_simulator *s, const double *c, double *out)
{
    for (int k = 0; k < s->equations->freedom; k++)
        out[k] = project_on(s, k, c);
}

/* M T and T' M T. */
static void reduce_mass(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = e->freedom, r = rank_of(e);
    for (int l = 0; l < f; l++) {
        double *moved = part->moved + (ptrdiff_t)l * n;
        copy(n, part->mass + (ptrdiff_t)part->column[r + l] * n, moved);
        for (int t = part->touch_begin[l]; t < part->touch_begin[l + 1]; t++)
            add_moved(s, part->block[part->touch[t]], part->block[part->touch[t] + 1], part->tangent + (ptrdiff_t)l * r,
                      moved);
        for (int k = l; k < f; k++)
            part->reduced[k + l * f] = project_on(s, k, moved);
    }
}

/* Column j: the change of C by multiplier j at the placed multipliers. Subtracts these changes from C: `bias` is that
 * of the tangent at zero multipliers. */
static void evaluate_loads(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, r = rank_of(e);
    kempe_arguments at = arguments_at(s, t);
    e->loads(&at, part->pick);
    for (int j = 0; j < r; j++)
        for (int i = 0; i < n; i++) {
            double slope = part->pick[i * e->rows + part->row[j]];
            part->loads[i + j * n] = slope;
            part->bias[i] -= slope * part->lambda[part->row[j]];
        }
}

/* The largest change of the placed multipliers by those of the last solution, which take their place, relative to the
 * largest one. */
static double take_multipliers(kempe_simulator *s, const double *found)
{
    struct kempe_simulator_parts *part = &s->part;
    double change = 0, size = 0;
    for (int j = 0; j < rank_of(s->equations); j++) {
        double *lambda = &part->lambda[part->row[j]];
        double size_of_row = s->equations->row_scale[part->row[j]];
        change = fmax(change, fabs(found[j] - *lambda) * size_of_row);
        size = fmax(size, fabs(found[j]) * size_of_row);
        *lambda = found[j];
    }
    return size > 0 ? change / size : change;
}

/* [T'MT, T'L; Mv T, Lv - Jv'] of (udd, lambda). */
static outcome factor_joint(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = e->freedom, r = rank_of(e);
    for (int l = 0; l < f; l++) {
        for (int k = 0; k < f; k++)
            part->joint[k + l * n] = part->reduced[k > l ? k + l * f : l + k * f];
        for (int i = 0; i < r; i++)
            part->joint[f + i + l * n] = part->moved[part->column[i] + l * n];
    }
    for (int j = 0; j < r; j++) {
        double *column = part->joint + (ptrdiff_t)(f + j) * n;
        project(s, part->loads + (ptrdiff_t)j * n, column);
        for (int i = 0; i < r; i++)
            column[f + i] =
                part->loads[part->column[i] + j * n] - part->jacobian[(ptrdiff_t)part->row[j] * n + part->column[i]];
    }
    return kmp_lu_factor(n, part->joint, part->joint_pivot) ? SINGULAR_MASS : GOOD;
}

static outcome factor_mass(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int f = s->equations->freedom;
    for (int k = 0; k < f; k++)
        part->diagonal[k] = part->reduced[k + k * f];
    int bad = kmp_cholesky_factor(f, part->reduced);
    for (int k = 0; k < f && !bad; k++)
        bad = part->reduced[k + k * f] * part->reduced[k + k * f] > NO_MASS * part->diagonal[k] ? 0 : k + 1;
    if (bad)
        part->diagonal[0] = bad;
    return bad ? SINGULAR_MASS : GOOD;
}

/* M qdd - J' lambda + c = 0 for qdd = T udd: udd, and the multipliers (r; NULL: not wanted). */
static void solve_motion(kempe_simulator *s, const double *c, double *udd, double *lambda)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = e->freedom, r = rank_of(e);
    if (e->loads && r > 0) {
        project(s, c, part->right);
        for (int i = 0; i < r; i++)
            part->right[f + i] = c[part->column[i]];
        for (int i = 0; i < n; i++)
            part->right[i] = -part->right[i];
        kmp_lu_solve(n, part->joint, part->joint_pivot, 1, part->right);
        copy(f, part->right, udd);
        if (lambda)
            copy(r, part->right + f, lambda);
        return;
    }
    project(s, c, udd);
    for (int k = 0; k < f; k++)
        udd[k] = -udd[k];
    kmp_cholesky_solve(f, part->reduced, udd);
    for (int i = 0; lambda && i < r; i++) {
        int at = part->column[i];
        lambda[i] = c[at];
        for (int k = 0; k < f; k++)
            lambda[i] += part->moved[at + k * n] * udd[k];
    }
    if (lambda) {
        solve_loops_transposed(s, lambda);
        for (int i = 0; i < r; i++)
            lambda[i] *= part->inverse_row[part->row[i]];
    }
}

/* c = C + M a for the accelerations a of v at udd = 0, -Jv^-1 of `rows`. */
static void add_constant(kempe_simulator *s, const double *bias, const double *rows, double *c)
{
    solve_rows(s, rows, s->part.constant);
    copy(s->equations->coordinates, bias, c);
    add_moved(s, 0, rank_of(s->equations), s->part.constant, c);
}

/* By M and C alone. */
static outcome accelerate_once(kempe_simulator *s, double t)
{
    struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = arguments_at(s, t);
    s->equations->motion(&at, part->mass, part->bias, part->jdqd);
    s->work.evaluations++;
    reduce_mass(s);
    outcome said = factor_mass(s);
    if (said != GOOD)
        return said;
    add_constant(s, part->bias, part->jdqd, part->load);
    solve_motion(s, part->load, part->udd, NULL);
    return GOOD;
}

/* C depends on the multipliers: Newton's method from zero, of which one step is exact where C is linear in them. */
static outcome accelerate_loaded(kempe_simulator *s, double t)
{
    struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = arguments_at(s, t);
    double before = INFINITY;
    for (int k = 0; k < MOST_LOADS; k++) {
        s->equations->motion(&at, part->mass, part->bias, part->jdqd);
        s->work.evaluations++;
        evaluate_loads(s, t);
        if (k == 0)
            reduce_mass(s);
        outcome said = factor_joint(s);
        if (said != GOOD)
            return said;
        add_constant(s, part->bias, part->jdqd, part->load);
        solve_motion(s, part->load, part->udd, part->correction);
        double change = take_multipliers(s, part->correction);
        if (change <= LOADS_SETTLED || (change <= LOADS_ROUNDED && change >= before / 2))
            return GOOD;
        before = change;
    }
    return UNSETTLED;
}

/* udd at the placed q and qd. */
static outcome accelerate(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    clear(e->rows, part->lambda);
    outcome said = e->loads && rank_of(e) > 0 ? accelerate_loaded(s, t) : accelerate_once(s, t);
    if (said != GOOD)
        return said;
    for (int k = 0; k < e->freedom; k++)
        if (!(fabs(part->udd[k]) <= DBL_MAX))
            return NOT_FINITE;
    return said;
}

/* qdd and lambda at the place of the last evaluation. */
static void complete(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    solve_motion(s, part->load, part->udd, part->correction);
    for (int k = 0; k < f; k++)
        part->qdd[part->column[r + k]] = part->udd[k];
    for (int i = 0; i < r; i++) {
        double a = part->constant[i];
        for (int k = 0; k < f; k++)
            a += part->tangent[i + k * r] * part->udd[k];
        part->qdd[part->column[i]] = a;
        part->lambda[part->row[i]] = part->correction[i];
    }
}

/* -- the right-hand side -------------------------------------------------------------------------------- */

static void place_y(kempe_simulator *s, const double *y)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    for (int k = 0; k < f; k++) {
        part->q[part->column[r + k]] = y[k];
        part->qd[part->column[r + k]] = y[f + k];
    }
    for (int i = 0; i < r; i++)
        part->q[part->column[i]] = y[2 * f + i];
}

static void pack_y(const kempe_simulator *s, const double *q, const double *qd, double *y)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    for (int k = 0; k < f; k++) {
        y[k] = q[part->column[r + k]];
        y[f + k] = qd[part->column[r + k]];
    }
    for (int i = 0; i < r; i++)
        y[2 * f + i] = q[part->column[i]];
}

/* dy at the placed q and ud, with factored loops. */
static outcome slopes_here(kempe_simulator *s, double t, double *dy)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    evaluate_rates(s);
    outcome said = accelerate(s, t);
    for (int k = 0; dy && k < f; k++) {
        dy[k] = part->qd[part->column[r + k]];
        dy[f + k] = part->udd[k];
    }
    for (int i = 0; dy && i < r; i++)
        dy[2 * f + i] = part->qd[part->column[i]];
    return said;
}

static outcome slopes(kempe_simulator *s, double t, const double *y, double *dy)
{
    place_y(s, y);
    outcome said = evaluate_loops(s, t);
    return said == GOOD ? slopes_here(s, t, dy) : said;
}

/* The same with loops closed; dy may be NULL. */
static outcome slopes_closed(kempe_simulator *s, double t, const double *y, double *dy)
{
    place_y(s, y);
    outcome said = close_loops(s, t, NULL);
    return said == GOOD ? slopes_here(s, t, dy) : said;
}

/* -- messages ------------------------------------------------------------------------------------------ */

static int widest_row(const kempe_simulator *s)
{
    int worst = 0;
    double most = -1;
    for (int i = 0; i < s->equations->rows; i++)
        if (!(opening(s, i) <= most)) {
            most = opening(s, i);
            worst = i;
        }
    return worst;
}

/* The dependent coordinate whose pivot of Jv is least. */
static int lost_column(const kempe_simulator *s)
{
    const int *column = s->part.column;
    const double *loop = s->part.loop;
    int least = 0;
    double size = INFINITY;
    for (int b = 0; b < s->part.blocks; b++) {
        int from = s->part.block[b], count = s->part.block[b + 1] - from;
        for (int i = 0; i < count; i++) {
            double pivot = fabs(loop[i + i * count]) * s->equations->scale[column[from + i]];
            if (!(pivot >= size)) {
                least = from + i;
                size = pivot;
            }
        }
        loop += (ptrdiff_t)count * count;
    }
    return column[least];
}

static kempe_simulator_status explain(kempe_simulator *s, outcome said, double t)
{
    const kempe_equations *e = s->equations;
    int row, bad;
    switch (said) {
    case OPEN:
        row = widest_row(s);
        snprintf(
            s->message, sizeof s->message,
            "%s: the loops cannot be closed at t = %.9g: row '%s' has the residual %.2g (scaled); start nearer to a "
            "closed configuration, or change parameters so that the mechanism can reach this one",
            e->name, t, e->row_names[row], opening(s, row));
        break;
    case SINGULAR_LOOPS:
        row = lost_column(s);
        snprintf(s->message, sizeof s->message,
                 "%s: the loops do not determine coordinate '%s' at t = %.9g: the mechanism is at a singular "
                 "configuration, where its closures lose a row",
                 e->name, e->coordinate_names[row], t);
        break;
    case SINGULAR_MASS:
        bad = e->loads ? 0 : (int)s->part.diagonal[0] - 1;
        snprintf(
            s->message, sizeof s->message,
            "%s: the motion of coordinate '%s' moves no mass at t = %.9g: give a body that it moves mass or inertia",
            e->name, e->coordinate_names[s->part.column[rank_of(e) + bad]], t);
        break;
    case UNSETTLED:
        snprintf(s->message, sizeof s->message,
                 "%s: forces that depend on reactions have no solution that is found from zero reactions at t = %.9g: "
                 "such friction locks or has several solutions; reduce the force",
                 e->name, t);
        break;
    default:
        snprintf(s->message, sizeof s->message,
                 "%s: accelerations are not finite at t = %.9g: a force or an input there is not a number", e->name, t);
    }
    return KEMPE_SIMULATOR_FAILED;
}

/* -- choice of coordinates ------------------------------------------------------------------------------ */

static void set_weights(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    for (int k = 0; k < f; k++) {
        int c = part->column[r + k];
        bool state = e->coordinate_kind[c] == KEMPE_COORDINATE_STATE;
        double tolerance = s->settings.atol * e->scale[c];
        part->atol[k] = state ? UNCONTROLLED : tolerance;
        part->atol[f + k] = state ? tolerance : tolerance * part->state[AT_RATE];
    }
    for (int i = 0; i < r; i++)
        part->atol[2 * f + i] = s->settings.atol * e->scale[part->column[i]];
}

/* Chooses rows and dependent coordinates by complete pivoting of the scaled J, which is evaluated. Coordinates marked
 * as fixed (NULL: none) stay independent as far as they can. */
static void choose(kempe_simulator *s, const int *fixed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < m; i++)
            part->pick[i + (ptrdiff_t)j * m] =
                part->jacobian[(ptrdiff_t)i * n + j] * e->scale[j] * part->inverse_row[i];
    kmp_lu_complete(m, n, part->pick, fixed, part->new_row, part->new_column, part->pivots);
    for (int i = 0; i < m; i++)
        part->row[i] = part->new_row[i];
    for (int j = 0; j < n; j++)
        part->column[j] = part->new_column[j];
    find_structure(s);
}

/* Exchanges dependent and independent coordinates, largest entry of the scaled B first, until none exceeds GROWTH. J is
 * that of the present place. */
static outcome improve_choice(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    if (evaluate_loops(s, t) != GOOD)
        return SINGULAR_LOOPS;
    evaluate_rates(s);
    double *b = part->tangent;
    for (int k = 0; k < f; k++)
        for (int i = 0; i < r; i++)
            b[i + k * r] *= e->scale[part->column[r + k]] / e->scale[part->column[i]];
    for (int pass = 0; pass < 10 * (f + r); pass++) {
        int worst = 0;
        for (int at = 1; at < f * r; at++)
            if (fabs(b[at]) > fabs(b[worst]))
                worst = at;
        if (f * r == 0 || !(fabs(b[worst]) > GROWTH))
            break;
        int i = worst % r, k = worst / r;
        for (int j = 0; j < f; j++)
            if (j != k)
                (void)kmp_exchange_column(r, i, b + (ptrdiff_t)k * r, b + (ptrdiff_t)j * r);
        kmp_exchange_pivot(r, i, b + (ptrdiff_t)k * r);
        kmp_swap_int(&part->column[i], &part->column[r + k]);
        s->work.exchanges++;
    }
    find_structure(s);
    return GOOD;
}

/* Exchanges the choice at the placed, closed q; qd is placed too. */
static outcome exchange_choice(kempe_simulator *s, double t)
{
    if (evaluate_loops(s, t) != GOOD || share_of_rows(s) > ROWS_OUT)
        choose(s, NULL);
    outcome said = improve_choice(s, t);
    if (said == GOOD)
        said = evaluate_loops(s, t);
    if (said == GOOD)
        s->part.state[AT_SIGN] = signs_of_loops(s);
    set_weights(s);
    return said;
}

/* True where the choice at the place of the last evaluation is bad. */
static bool is_choice_bad(const kempe_simulator *s, double limit)
{
    return growth(s) > limit || share_of_rows(s) > ROWS_OUT;
}

/* The first redundant row that does not close with the others; -1: none. */
static int open_row(const kempe_simulator *s)
{
    double allowed =
        fmax(DROPPED_WEIGHTS * (s->settings.atol + s->settings.rtol), DROPPED_OVER * s->part.state[AT_LOOSE]);
    for (int i = rank_of(s->equations); i < s->equations->rows; i++)
        if (!(opening(s, s->part.row[i]) <= allowed))
            return s->part.row[i];
    return -1;
}

static kempe_simulator_status report_open_row(kempe_simulator *s, int row, double t)
{
    const kempe_equations *e = s->equations;
    snprintf(
        s->message, sizeof s->message,
        "%s: closure row '%s', redundant at the start, has the residual %.3g (scaled) at t = %.9g: the motion began "
        "at a change point, where the closures have a lower rank; start near it, on the intended branch",
        e->name, e->row_names[row], opening(s, row), t);
    return KEMPE_SIMULATOR_FAILED;
}

/* -- conditions ------------------------------------------------------------------------------------------ */

/* The distance of condition k beyond its change: above 0 it has changed. */
static double beyond(const kempe_simulator *s, int k, double value)
{
    const kempe_equations *e = s->equations;
    if (e->condition_kind[k] == KEMPE_CONDITION_KINK)
        return -INFINITY;
    return (s->part.modes[k] > 0 ? value : -value) - (e->lag ? e->lag[k] : 0);
}

static double most_beyond(const kempe_simulator *s, const double *value)
{
    double most = -INFINITY;
    for (int k = 0; k < s->equations->conditions; k++)
        most = fmax(most, beyond(s, k, value[k]));
    return most;
}

static bool has_changes(const kempe_simulator *s)
{
    for (int k = 0; k < s->equations->conditions; k++)
        if (s->equations->condition_kind[k] != KEMPE_CONDITION_KINK)
            return true;
    return false;
}

static void put_place(const kempe_simulator *s, double *place)
{
    const struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates;
    copy(n, part->q, place);
    copy(n, part->qd, place + n);
    copy(n, part->qdd, place + 2 * n);
    copy(s->equations->rows, part->lambda, place + 3 * n);
}

static void evaluate_changes(kempe_simulator *s, double t, double *value)
{
    kempe_arguments at = arguments_at(s, t);
    s->equations->changes(&at, value);
}

static kempe_simulator_status end_motion(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    int k = (int)s->part.state[AT_ENDED] - 1;
    const char *advice = e->advice ? e->advice[k] : NULL;
    snprintf(s->message, sizeof s->message, "%s: the motion ends at t = %.9g: %s%s%s", e->name, s->t,
             e->condition_names[k], advice && *advice ? "; " : "", advice ? advice : "");
    return KEMPE_SIMULATOR_ENDED;
}

/* Changes the mode of condition k at t. False after a message: it changes back and forth. */
static bool change_mode(kempe_simulator *s, int k, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double instant = fmax(64 * DBL_EPSILON * fabs(t), INSTANT / part->state[AT_RATE]);
    part->modes[k] = part->modes[k] > 0 ? 0 : 1;
    part->repeats[k] = t - part->last[k] <= instant ? part->repeats[k] + 1 : 0;
    part->last[k] = t;
    s->work.events++;
    if (part->repeats[k] < MOST_PASSES)
        return true;
    const char *advice = e->advice ? e->advice[k] : NULL;
    snprintf(s->message, sizeof s->message, "%s: %s changes back and forth at t = %.9g: %s", e->name,
             e->condition_names[k], t,
             advice && *advice
                 ? advice
                 : "the motion slides along this condition; make the law continuous there, for instance with tanh");
    return false;
}

/* Rates after an impact, where modes have changed the closures: M (qd - before) = J' p, J qd + h_t = 0. The placed qd
 * is that before; loops and motion are evaluated. */
static outcome jump(kempe_simulator *s, double t, const double *before, double *y)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = e->freedom, r = rank_of(e);
    double worst = 0, fastest = 0;
    for (int j = 0; j < n; j++) {
        worst = fmax(worst, fabs(part->qd[j] - before[j]) / e->scale[j]);
        fastest = fmax(fastest, fabs(before[j]) / e->scale[j]);
    }
    if (!(worst > JUMP * fastest))
        return GOOD;
    for (int k = 0; k < f; k++)
        part->qd[part->column[r + k]] = 0;
    evaluate_rates(s);
    reduce_mass(s);
    if (factor_mass(s) != GOOD)
        return SINGULAR_MASS;
    for (int i = 0; i < n; i++) {
        part->right[i] = 0;
        for (int j = 0; j < n; j++)
            part->right[i] += part->mass[(ptrdiff_t)i * n + j] * (before[j] - part->qd[j]);
    }
    project(s, part->right, part->udd);
    kmp_cholesky_solve(f, part->reduced, part->udd);
    copy(f, part->udd, y + f);
    for (int k = 0; k < f; k++)
        y[k] = part->q[part->column[r + k]];
    for (int i = 0; i < r; i++)
        y[2 * f + i] = part->q[part->column[i]];
    return slopes_closed(s, t, y, NULL);
}

/* Changes modes at the state y until all conditions agree with them; *changed: some have. At the start lags do not
 * count. The state is placed and complete. */
static kempe_simulator_status settle_modes(kempe_simulator *s, double t, double *y, bool lags, bool *changed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int last = -1;
    for (int pass = 0; pass < MOST_PASSES; pass++) {
        if (pass > 0)
            copy(e->coordinates, part->qd, part->dqd);
        outcome said = slopes_closed(s, t, y, NULL);
        if (said == GOOD && lags && *changed)
            said = jump(s, t, part->dqd, y);
        if (said != GOOD)
            return explain(s, said, t);
        complete(s);
        if (!has_changes(s))
            return KEMPE_SIMULATOR_GOES;
        evaluate_changes(s, t, part->value);
        last = -1;
        for (int k = 0; k < e->conditions; k++) {
            double lag = e->lag && !lags ? e->lag[k] : 0;
            if (!(beyond(s, k, part->value[k]) + lag > 0))
                continue;
            if (e->condition_kind[k] == KEMPE_CONDITION_ENDS) {
                part->state[AT_ENDED] = k + 1;
                continue;
            }
            if (!change_mode(s, k, t))
                return KEMPE_SIMULATOR_FAILED;
            *changed = true;
            last = k;
        }
        if (last < 0)
            return KEMPE_SIMULATOR_GOES;
    }
    snprintf(s->message, sizeof s->message, "%s: %s contradicts another condition at t = %.9g", e->name,
             e->condition_names[last], t);
    return KEMPE_SIMULATOR_FAILED;
}

/* -- dense output ---------------------------------------------------------------------------------------- */

static void list_stages(const kempe_simulator *s, double **k)
{
    for (int i = 0; i < KMP_RK_MAX_STAGES; i++)
        k[i + 1] = s->part.stages + (ptrdiff_t)i * size_of_y(s->equations);
    k[0] = NULL;
}

static void list_vectors(const kempe_simulator *s, double **r)
{
    for (int i = 0; i < KMP_RK_MAX_INTERPOLANTS; i++)
        r[i] = s->part.vectors + (ptrdiff_t)i * size_of_y(s->equations);
}

/* k[number] = f(t + c h, y + h sum a k), within a function that has s, size, y, h, t, k and C. */
#define STAGE(number, a, ...)                                                                                          \
    do {                                                                                                               \
        kmp_rk_combine(size, y, h, KMP_TERMS(a), a, (const double *const[]){__VA_ARGS__}, s->part.stage);              \
        outcome at_stage = slopes(s, t + C[number] * h, s->part.stage, k[number]);                                     \
        if (at_stage != GOOD)                                                                                          \
            return at_stage;                                                                                           \
    } while (0)

/* The vectors of the dense output of the last step. */
static outcome prepare_dense(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int size = size_of_y(s->equations);
    double *state = part->state, *k[KMP_RK_MAX_STAGES + 1], *r[KMP_RK_MAX_INTERPOLANTS];
    double t = state[AT_BEGIN], h = state[AT_TAKEN];
    const double *y = part->y_old, *const C = kmp_dop853_c;
    bool long_one = state[AT_METHOD_TAKEN] == (double)KEMPE_METHOD_DOP853;
    if (state[AT_DENSE] > 0)
        return GOOD;
    list_stages(s, k);
    list_vectors(s, r);
    if (long_one)
        KMP_DOP853_DENSE_STAGES(STAGE, k);
    const double *end = k[methods[(int)state[AT_METHOD_TAKEN]].end];
    for (int i = 0; i < size; i++) {
        double cubic[4];
        kmp_rk_cubic(h, y[i], part->y_new[i], k[1][i], end[i], cubic);
        for (int j = 0; j < 4; j++) {
            r[j][i] = cubic[j];
            if (long_one)
                r[4 + j][i] = kmp_dop853_dense(h, k, (size_t)i, j);
        }
        if (!long_one)
            r[4][i] = kmp_dopri5_dense(h, k, i);
    }
    state[AT_DENSE] = 1;
    return GOOD;
}

/* y at t within the last step. */
static outcome interpolate(kempe_simulator *s, double t, double *y)
{
    struct kempe_simulator_parts *part = &s->part;
    const double *state = part->state;
    int size = size_of_y(s->equations);
    double *r[KMP_RK_MAX_INTERPOLANTS];
    if (t == state[AT_END] || !(state[AT_TAKEN] > 0) || !(t > state[AT_BEGIN])) {
        copy(size, t == state[AT_END] || !(state[AT_TAKEN] > 0) ? part->y_new : part->y_old, y);
        return GOOD;
    }
    outcome said = prepare_dense(s);
    list_vectors(s, r);
    if (said == GOOD)
        kmp_rk_interpolate(size, methods[(int)state[AT_METHOD_TAKEN]].interpolants, r,
                           (t - state[AT_BEGIN]) / state[AT_TAKEN], y);
    return said;
}

/* -- events ---------------------------------------------------------------------------------------------- */

/* The values of conditions at part x of the last step by polynomials through both ends with their accelerations: a few
 * roundings of a step's error away, without evaluations. */
static void estimate_changes(kempe_simulator *s, double x, double *value)
{
    struct kempe_simulator_parts *part = &s->part;
    int n = s->equations->coordinates, m = s->equations->rows;
    const double *begin = part->begin, *end = part->end;
    double h = part->state[AT_TAKEN];
    for (int i = 0; i < n; i++) {
        double p0 = begin[i], p1 = h * begin[n + i], p2 = 0.5 * h * h * begin[2 * n + i];
        double a = end[i] - p0 - p1 - p2, b = h * end[n + i] - p1 - 2 * p2, c = 0.5 * (h * h * end[2 * n + i] - 2 * p2);
        double p3 = 10 * a - 4 * b + c, p4 = -15 * a + 7 * b - 2 * c, p5 = 6 * a - 3 * b + c;
        part->q[i] = p0 + x * (p1 + x * (p2 + x * (p3 + x * (p4 + x * p5))));
        part->qd[i] = (p1 + x * (2 * p2 + x * (3 * p3 + x * (4 * p4 + x * 5 * p5)))) / h;
        part->qdd[i] = (2 * p2 + x * (6 * p3 + x * (12 * p4 + x * 20 * p5))) / (h * h);
    }
    for (int i = 0; i < m; i++)
        part->lambda[i] = begin[3 * n + i] + x * (end[3 * n + i] - begin[3 * n + i]);
    evaluate_changes(s, part->state[AT_BEGIN] + x * h, value);
}

/* The values of conditions at t within the last step, which is placed. */
static outcome look_at(kempe_simulator *s, double t, double *value)
{
    struct kempe_simulator_parts *part = &s->part;
    outcome said = interpolate(s, t, part->probe);
    if (said != GOOD)
        return said;
    place_y(s, part->probe);
    said = close_loops(s, t, NULL);
    if (said != GOOD)
        return said;
    evaluate_rates(s);
    if (!s->equations->early) {
        said = accelerate(s, t);
        if (said != GOOD)
            return said;
        complete(s);
    }
    evaluate_changes(s, t, value);
    return GOOD;
}

typedef struct glance {
    kempe_simulator *s;
    int condition;
} glance;

static double estimated_distance(void *self, double x)
{
    const glance *g = self;
    double *value = g->s->part.changes + (ptrdiff_t)(SAMPLES + 1) * g->s->equations->conditions;
    estimate_changes(g->s, x, value);
    return -beyond(g->s, g->condition, value[g->condition]);
}

/* A part of the step within a sample length of sample `at` where a condition changes for a short time alone; 0: none.
 * The top of a parabola through three samples tells where to look closer. */
static double find_peak(kempe_simulator *s, int at)
{
    int count = s->equations->conditions;
    const double *value = s->part.changes + (ptrdiff_t)at * count, step = 1.0 / SAMPLES;
    for (int k = 0; k < count; k++) {
        double before = beyond(s, k, value[k - count]), here = beyond(s, k, value[k]);
        double after = beyond(s, k, value[k + count]), bend = before - 2 * here + after, rise = 0.5 * (after - before);
        bool none = !(fmax(here, fmax(before, after)) <= 0) || !(bend < 0 && fabs(rise) <= -bend);
        if (none || here - 0.5 * rise * rise / bend - 0.25 * bend <= 0)
            continue;
        glance g = {s, k};
        double x = kmp_bracket_least(estimated_distance, &g, (at - 1) * step, (at + 1) * step, 1e-4);
        if (estimated_distance(&g, x) < 0)
            return x;
    }
    return 0;
}

/* Narrows the first change between parts `near` and `far` of the step to *t, where it has happened, with the values
 * there. */
static outcome narrow(kempe_simulator *s, double near, double f_near, double far, double f_far, double *t)
{
    struct kempe_simulator_parts *part = &s->part;
    double begin = part->state[AT_BEGIN], *value = part->changes + (ptrdiff_t)(SAMPLES + 2) * s->equations->conditions;
    double tolerance = fmax(4 * DBL_EPSILON * fmax(fabs(near), fabs(far)), 1e-14 * (far - near)), x;
    kmp_bracket b = kmp_bracket_of(near - begin, f_near, far - begin, f_far);
    while (kmp_bracket_next(&b, tolerance, &x)) {
        outcome said = look_at(s, begin + x, value);
        if (said != GOOD)
            return said;
        double f = most_beyond(s, value);
        kmp_bracket_take(&b, x, f, f > 0);
    }
    *t = begin + b.far;
    return look_at(s, *t, value);
}

/* Cuts the step at t, where the values have changed. */
static void cut_step(kempe_simulator *s, double t, const double *value)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    for (int k = 0; k < e->conditions; k++) {
        bool changes = beyond(s, k, value[k]) > 0;
        part->flip[k] = changes && e->condition_kind[k] == KEMPE_CONDITION_SWITCHES;
        if (changes && e->condition_kind[k] == KEMPE_CONDITION_ENDS && !(part->state[AT_ENDED] > 0))
            part->state[AT_ENDED] = k + 1;
    }
    pack_y(s, part->q, part->qd, part->y_new);
    part->state[AT_END] = t;
    part->state[AT_EVENT] = part->state[AT_FRESH] = 1;
    part->state[AT_EXCHANGE] = is_choice_bad(s, GROWTH);
}

/* Looks at the window up to part x of the step; *found: an event lies there, at which the step now ends. */
static outcome try_window(kempe_simulator *s, double from, double x, bool *found)
{
    struct kempe_simulator_parts *part = &s->part;
    int count = s->equations->conditions;
    double *value = part->changes + (ptrdiff_t)(SAMPLES + 2) * count, t = 0, begin = part->state[AT_BEGIN];
    double h = part->state[AT_TAKEN], far = x < 1 ? begin + x * h : part->state[AT_END], near = begin + from * h;
    outcome said = prepare_dense(s);
    if (said == GOOD)
        said = look_at(s, far, value);
    double f_far = said == GOOD ? most_beyond(s, value) : 0;
    if (said != GOOD || !(f_far > 0))
        return said;
    said = look_at(s, near, value);
    double f_near = said == GOOD ? most_beyond(s, value) : 0;
    if (f_near > 0 && near > begin) {
        far = near;
        f_far = f_near;
        near = begin;
        f_near = 0;
    }
    if (said == GOOD)
        said = narrow(s, near, f_near, far, f_far, &t);
    if (said == GOOD) {
        cut_step(s, t, value);
        *found = true;
    }
    return said;
}

/* Finds the first change of a condition within the last step, whose ends are complete. */
static outcome find_event(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int count = s->equations->conditions;
    bool found = false;
    outcome said = GOOD;
    for (int j = 0; j <= SAMPLES; j++)
        estimate_changes(s, (double)j / SAMPLES, part->changes + (ptrdiff_t)j * count);
    for (int j = 1; j <= SAMPLES && !found && said == GOOD; j++) {
        double peak = j < SAMPLES ? find_peak(s, j) : 0, here = (double)j / SAMPLES, from = here - 1.0 / SAMPLES;
        bool changed = most_beyond(s, part->changes + (ptrdiff_t)j * count) > 0;
        if (peak > 0)
            said = try_window(s, fmin(from, 0.5 * peak), peak, &found);
        if (changed && !found && said == GOOD)
            said = try_window(s, from, here, &found);
    }
    return said;
}

/* -- steps ------------------------------------------------------------------------------------------------- */

/* Stages, solution, weights and error of a step h from y_new to `candidate`, whose loops are closed. */
static outcome run_stages(kempe_simulator *s, double h, double *error)
{
    struct kempe_simulator_parts *part = &s->part;
    int size = size_of_y(s->equations);
    double *k[KMP_RK_MAX_STAGES + 1], t = part->state[AT_END];
    const double *y = part->y_new, *C;
    list_stages(s, k);
    if (s->settings.method == KEMPE_METHOD_DOP853) {
        const kmp_dop853_step step = {y, &h, part->atol, k, s->settings.rtol, part->candidate, part->weight, error};
        C = kmp_dop853_c;
        KMP_DOP853_STAGES(STAGE, k);
        kmp_dop853_solution(1, (size_t)size, &step);
    } else {
        C = kmp_dopri5_c;
        KMP_DOPRI5_STAGES(STAGE, k);
        kmp_dopri5_solution(size, y, h, k, part->candidate);
        outcome said = slopes(s, t + h, part->candidate, k[7]);
        if (said != GOOD)
            return said;
        *error = kmp_dopri5_error(size, h, k, y, part->candidate, part->atol, s->settings.rtol, part->weight);
    }
    return GOOD;
}

/* The correction that closes the loops at the end, in error weights; within rounding 0. */
static double closing_of(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    double worst = 0;
    for (int i = 0; i < rank_of(e); i++) {
        int at = 2 * e->freedom + i, c = part->column[i];
        double dv = fabs(part->q[c] - part->candidate[at]);
        if (!(dv <= fmin(part->weight[at], CORRECTION_ROUNDING * e->scale[c])))
            worst = fmax(worst, dv / part->weight[at]);
    }
    return worst;
}

/* Result of an attempt. */
typedef enum attempt_result { TAKEN, BAD_ERROR, BAD_STAGE, BAD_STEP } attempt_result;

static attempt_result attempt(kempe_simulator *s, double h, double t_new, double *error, outcome *said)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    bool fixed = s->settings.fixed_step > 0;
    double *k[KMP_RK_MAX_STAGES + 1];
    list_stages(s, k);
    *said = run_stages(s, h, error);
    if (*said != GOOD)
        return BAD_STAGE;
    if (!(*error <= (fixed ? DBL_MAX : 1.0)))
        return BAD_ERROR;
    place_y(s, part->candidate);
    *said = close_loops(s, t_new, NULL);
    if (*said != GOOD)
        return BAD_STAGE;
    double limit = e->rows > rank_of(e) ? CORRECTION_REDUNDANT : CORRECTION_LIMIT;
    if (signs_of_loops(s) != part->state[AT_SIGN] || (!fixed && closing_of(s) > limit))
        return BAD_STEP;
    for (int i = 0; i < rank_of(e); i++)
        part->candidate[2 * e->freedom + i] = part->q[part->column[i]];
    *said = slopes_here(s, t_new, k[methods[s->settings.method].end]);
    return *said == GOOD ? TAKEN : BAD_STAGE;
}

/* Hairer's first step. */
static outcome choose_first_step(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int size = size_of_y(s->equations);
    double *k[KMP_RK_MAX_STAGES + 1], t = part->state[AT_END], longest = s->settings.end - t;
    list_stages(s, k);
    for (int i = 0; i < size; i++)
        part->weight[i] = part->atol[i] + s->settings.rtol * fabs(part->y_new[i]);
    double slope = kmp_rk_weighted_square(size, k[1], NULL, part->weight);
    double h = kmp_rk_euler_step(slope, kmp_rk_weighted_square(size, part->y_new, NULL, part->weight), longest);
    outcome said = OPEN;
    for (int pass = 0; pass < MOST_CLOSINGS && said != GOOD; pass++) {
        h = pass ? h / 4 : h;
        for (int i = 0; i < size; i++)
            part->stage[i] = part->y_new[i] + h * k[1][i];
        said = slopes(s, t + h, part->stage, k[2]);
    }
    double change = kmp_rk_weighted_square(size, k[2], k[1], part->weight);
    part->state[AT_NEXT] = kmp_rk_first_step(h, slope, change, methods[s->settings.method].order, longest);
    return said;
}

/* Changes the modes that change at the end of the last step. False after a message. */
static bool flip_modes(kempe_simulator *s, double t)
{
    for (int k = 0; k < s->equations->conditions; k++)
        if (s->part.flip[k] > 0 && !change_mode(s, k, t))
            return false;
    clear(s->equations->conditions, s->part.flip);
    return true;
}

/* Does what the last step has left: changes modes, exchanges the choice, evaluates the derivative. */
static kempe_simulator_status begin_step(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state, t = state[AT_END], *k[KMP_RK_MAX_STAGES + 1];
    bool changed = false;
    list_stages(s, k);
    if (state[AT_EVENT] > 0) {
        place_y(s, part->y_new);
        if (evaluate_loops(s, t) == GOOD)
            evaluate_rates(s);
        copy(e->coordinates, part->qd, part->dqd);
        changed = true;
        if (!flip_modes(s, t))
            return KEMPE_SIMULATOR_FAILED;
        kempe_simulator_status status = settle_modes(s, t, part->y_new, true, &changed);
        if (status != KEMPE_SIMULATOR_GOES)
            return status;
        pack_y(s, part->q, part->qd, part->y_new);
        state[AT_EVENT] = 0;
        state[AT_FRESH] = 1;
    }
    if (state[AT_EXCHANGE] > 0) {
        place_y(s, part->y_new);
        outcome said = evaluate_loops(s, t);
        if (said == GOOD)
            evaluate_rates(s);
        said = said == GOOD ? exchange_choice(s, t) : said;
        if (said != GOOD)
            return explain(s, said, t);
        pack_y(s, part->q, part->qd, part->y_new);
        state[AT_EXCHANGE] = 0;
        state[AT_FRESH] = 1;
    }
    set_weights(s);
    if (!(state[AT_FRESH] > 0)) {
        copy(size_of_y(e), k[methods[(int)state[AT_METHOD_TAKEN]].end], k[1]);
        copy(3 * e->coordinates + e->rows, part->end, part->begin);
        return KEMPE_SIMULATOR_GOES;
    }
    outcome said = slopes(s, t, part->y_new, k[1]);
    if (said != GOOD)
        return explain(s, said, t);
    complete(s);
    put_place(s, part->begin);
    state[AT_SIGN] = signs_of_loops(s);
    state[AT_FRESH] = 0;
    if (!(state[AT_NEXT] > 0) && !(s->settings.fixed_step > 0))
        said = choose_first_step(s);
    return said == GOOD ? KEMPE_SIMULATOR_GOES : explain(s, said, t);
}

/* Takes an attempt: the state at its end and what is to be done there. */
static kempe_simulator_status take_step(kempe_simulator *s, double h, double t_new, double error)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state;
    int size = size_of_y(e);
    state[AT_NEXT] =
        kmp_rk_after_accepted(&methods[s->settings.method], h, error, state[AT_ERROR], state[AT_REJECTED] > 0);
    state[AT_ERROR] = fmax(error, KMP_RK_ERROR_FLOOR);
    state[AT_REJECTED] = 0;
    state[AT_BEGIN] = state[AT_END];
    state[AT_END] = t_new;
    state[AT_TAKEN] = h;
    state[AT_METHOD_TAKEN] = (double)s->settings.method;
    state[AT_DENSE] = 0;
    copy(size, part->y_new, part->y_old);
    copy(size, part->candidate, part->y_new);
    s->work.steps++;
    int row = open_row(s);
    if (row >= 0)
        return report_open_row(s, row, t_new);
    state[AT_EXCHANGE] = is_choice_bad(s, GROWTH);
    if (!has_changes(s))
        return KEMPE_SIMULATOR_GOES;
    complete(s);
    put_place(s, part->end);
    outcome said = find_event(s);
    return said == GOOD ? KEMPE_SIMULATOR_GOES : explain(s, said, t_new);
}

static kempe_simulator_status give_up(kempe_simulator *s, outcome said, attempt_result what)
{
    double t = s->part.state[AT_END];
    if (what == BAD_STAGE)
        return explain(s, said, t);
    const char *reason = what == BAD_STEP
                             ? "it passes a place where the loops do not determine the dependent coordinates"
                             : "the motion is singular there, or too fast";
    if (s->settings.fixed_step > 0)
        snprintf(s->message, sizeof s->message,
                 "%s: no step of the constant length %.6g s can be made at t = %.9g: %s; shorten it",
                 s->equations->name, s->settings.fixed_step, t, reason);
    else
        snprintf(s->message, sizeof s->message,
                 "%s: the step size is close to the resolution of double precision at t = %.9g: %s", s->equations->name,
                 t, reason);
    return KEMPE_SIMULATOR_FAILED;
}

static kempe_simulator_status make_step(kempe_simulator *s)
{
    double *state = s->part.state;
    kempe_simulator_status status = begin_step(s);
    if (status != KEMPE_SIMULATOR_GOES || state[AT_ENDED] > 0)
        return status;
    outcome said = GOOD;
    attempt_result what = BAD_ERROR;
    bool fixed = s->settings.fixed_step > 0;
    for (int tries = 0; tries < MOST_ATTEMPTS; tries++) {
        double t = state[AT_END], t_new = t, error = 0, next = state[AT_NEXT];
        int hopeless = (int)state[AT_HOPELESS];
        if (s->settings.longest > 0)
            next = fmin(next, s->settings.longest);
        double h = !fixed       ? kmp_step_next(t, s->settings.end, next, &t_new)
                   : tries == 0 ? kmp_step_constant(t, s->settings.end, s->settings.fixed_step, &t_new)
                                : 0;
        if (!(h > 0))
            break;
        what = attempt(s, h, t_new, &error, &said);
        if (what == TAKEN) {
            bool collapsed = kmp_step_collapsed(&hopeless, h, t_new);
            state[AT_HOPELESS] = hopeless;
            return collapsed ? give_up(s, GOOD, BAD_ERROR) : take_step(s, h, t_new, error);
        }
        s->work.rejected++;
        state[AT_NEXT] = what == BAD_ERROR   ? kmp_rk_after_rejected(&methods[s->settings.method], h, error)
                         : what == BAD_STAGE ? h / 4
                                             : h / 2;
        state[AT_REJECTED] = 1;
    }
    return give_up(s, said, what);
}

/* -- outputs ------------------------------------------------------------------------------------------------ */

/* Makes the placed, complete state the present one, with its conditions and outputs. */
static void show_place(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = e->freedom;
    copy(n, part->q, s->q);
    copy(n, part->qd, s->qd);
    copy(n, part->qdd, s->qdd);
    copy(e->rows, part->lambda, s->lambda);
    kempe_arguments at = arguments_at(s, t);
    if (e->conditions > 0)
        e->changes(&at, part->value);
    if (e->outputs > 0)
        e->show(&at, s->y);
    for (int k = 0; k < f; k++) {
        int c = part->column[rank_of(e) + k];
        part->x[k] = s->q[c];
        part->x[f + k] = part->rates[k] = s->qd[c];
        part->rates[f + k] = s->qdd[c];
    }
    s->t = t;
    part->state[AT_BAD] = is_choice_bad(s, GROWTH_OF_CALLERS);
    *factors_are_present(s) = 1;
}

/* Shows the state y at t with its loops closed. */
static outcome show_state(kempe_simulator *s, double t, const double *y)
{
    outcome said = slopes_closed(s, t, y, NULL);
    if (said == GOOD) {
        complete(s);
        show_place(s, t);
    }
    return said;
}

static kempe_simulator_status show_at(kempe_simulator *s, double t)
{
    outcome said = interpolate(s, t, s->part.probe);
    if (said == GOOD)
        said = show_state(s, t, s->part.probe);
    return said == GOOD ? KEMPE_SIMULATOR_GOES : explain(s, said, t);
}

/* -- start -------------------------------------------------------------------------------------------------- */

/* The end of the last step is t, at the placed, closed q and ud; the next step starts there. */
static void restart(kempe_simulator *s, double t)
{
    double *state = s->part.state;
    if (state[AT_TAKEN] > 0 && t < state[AT_END])
        state[AT_NEXT] = state[AT_TAKEN];
    pack_y(s, s->part.q, s->part.qd, s->part.y_new);
    state[AT_BEGIN] = state[AT_END] = t;
    state[AT_TAKEN] = 0;
    state[AT_DENSE] = state[AT_EVENT] = state[AT_EXCHANGE] = state[AT_ENDED] = 0;
    state[AT_ERROR] = KMP_RK_ERROR_FLOOR;
    state[AT_REJECTED] = state[AT_HOPELESS] = 0;
    state[AT_FRESH] = 1;
    clear(s->equations->conditions, s->part.flip);
}

/* Makes the first choice at the placed q, before and after the loops are closed. */
static outcome close_start(kempe_simulator *s, double t, const int *fixed)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int r = rank_of(e);
    for (int i = 0; i < e->rows; i++)
        part->row[i] = i;
    for (int j = 0; j < e->coordinates; j++)
        part->column[j] = j;
    find_structure(s);
    (void)evaluate_loops(s, t);
    choose(s, fixed);
    outcome said = close_loops(s, t, NULL);
    if (said != GOOD)
        return said;
    (void)evaluate_loops(s, t);
    choose(s, fixed);
    if (r > 0 && !(part->pivots[r - 1] > e->rank_tolerance * part->pivots[0])) {
        (void)evaluate_loops(s, t);
        return SINGULAR_LOOPS;
    }
    said = close_loops(s, t, NULL);
    return said == GOOD && !fixed ? improve_choice(s, t) : said;
}

/* The rate of the motion, 1/s: of the tolerances of rates. */
static double rate_of_motion(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const struct kempe_simulator_parts *part = &s->part;
    double left = s->settings.end - part->state[AT_END], rate = left > 0 && left <= DBL_MAX ? 1 / left : 0;
    for (int i = 0; i < e->coordinates; i++) {
        rate = fmax(rate, fabs(part->qd[i]) / e->scale[i]);
        rate = fmax(rate, sqrt(fabs(part->qdd[i]) / e->scale[i]));
    }
    return rate > 0 && rate <= DBL_MAX ? rate : 1;
}

static kempe_simulator_status start_here(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    double *state = part->state;
    int *fixed = e->independent ? part->fixed : NULL;
    bool changed = false;
    for (int j = 0; j < e->coordinates; j++)
        part->fixed[j] = 0;
    for (int k = 0; fixed && k < e->freedom; k++)
        fixed[e->independent[k]] = 1;
    clear(HEADER, state);
    clear(3 * e->coordinates + e->rows, part->begin);
    state[AT_RATE] = 1;
    state[AT_END] = t;
    clear(e->conditions, part->modes);
    clear(e->conditions, part->repeats);
    for (int k = 0; k < e->conditions; k++)
        part->last[k] = -DBL_MAX;
    copy(3 * e->inputs, s->u, part->held);
    if (e->prepare)
        e->prepare(s->p, part->k);
    outcome said = close_start(s, t, fixed);
    if (said != GOOD)
        return explain(s, said, t);
    for (int i = rank_of(e); i < e->rows; i++)
        state[AT_LOOSE] = fmax(state[AT_LOOSE], opening(s, part->row[i]));
    if (state[AT_LOOSE] > DROPPED_START)
        return explain(s, OPEN, t);
    pack_y(s, part->q, part->qd, part->y_new);
    kempe_simulator_status status = settle_modes(s, t, part->y_new, false, &changed);
    if (status != KEMPE_SIMULATOR_GOES)
        return status;
    state[AT_RATE] = rate_of_motion(s);
    set_weights(s);
    double ended = state[AT_ENDED];
    restart(s, t);
    state[AT_ENDED] = ended;
    state[AT_STARTED] = 1;
    show_place(s, t);
    return ended > 0 ? end_motion(s) : KEMPE_SIMULATOR_GOES;
}

kempe_simulator_status kempe_simulator_start_from(kempe_simulator *s, double t, const double *q, const double *qd)
{
    s->message[0] = 0;
    kempe_simulator_save(s, s->part.backup);
    copy(s->equations->coordinates, q, s->part.q);
    copy(s->equations->coordinates, qd, s->part.qd);
    kempe_simulator_status status = start_here(s, t);
    if (status == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
    return status;
}

kempe_simulator_status kempe_simulator_start(kempe_simulator *s, double t)
{
    return kempe_simulator_start_from(s, t, s->equations->start_q, s->equations->start_qd);
}

static kempe_simulator_status refuse_before_start(kempe_simulator *s)
{
    snprintf(s->message, sizeof s->message, "%s: the simulator has not been started: call kempe_simulator_start",
             s->equations->name);
    return KEMPE_SIMULATOR_FAILED;
}

/* -- advance ------------------------------------------------------------------------------------------------ */

static kempe_simulator_status step_to(kempe_simulator *s, double t)
{
    double *state = s->part.state, most = s->settings.most_steps > 0 ? s->settings.most_steps : 1e6;
    for (double steps = 0; state[AT_END] < t && !(state[AT_ENDED] > 0); steps++) {
        if (steps >= most) {
            snprintf(s->message, sizeof s->message,
                     "%s: %.0f steps end at t = %.9g, before t = %.9g: loosen the tolerances, or raise most_steps",
                     s->equations->name, most, state[AT_END], t);
            return KEMPE_SIMULATOR_FAILED;
        }
        kempe_simulator_status status = make_step(s);
        if (status != KEMPE_SIMULATOR_GOES)
            return status;
    }
    if (!(state[AT_ENDED] > 0) || t < state[AT_END])
        return show_at(s, t);
    kempe_simulator_status status = show_at(s, state[AT_END]);
    return status == KEMPE_SIMULATOR_GOES ? end_motion(s) : status;
}

/* Calls step_to, and takes back what it did where it fails. */
static kempe_simulator_status step_or_return(kempe_simulator *s, double t)
{
    s->message[0] = 0;
    kempe_simulator_save(s, s->part.backup);
    kempe_simulator_status status = step_to(s, t);
    if (status == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
    return status;
}

kempe_simulator_status kempe_simulator_advance(kempe_simulator *s, double t)
{
    if (!(s->part.state[AT_STARTED] > 0))
        return refuse_before_start(s);
    if (t >= s->t && t <= s->settings.end)
        return step_or_return(s, t);
    snprintf(s->message, sizeof s->message, "%s: t = %.9g lies outside of the times from %.9g to the end %.9g",
             s->equations->name, t, s->t, s->settings.end);
    return KEMPE_SIMULATOR_FAILED;
}

kempe_simulator_status kempe_simulator_step(kempe_simulator *s)
{
    double *state = s->part.state;
    if (!(state[AT_STARTED] > 0))
        return refuse_before_start(s);
    if (state[AT_END] > s->t || state[AT_ENDED] > 0)
        return step_or_return(s, state[AT_END]);
    if (!(s->t < s->settings.end)) {
        snprintf(s->message, sizeof s->message, "%s: t = %.9g is the end of the motion", s->equations->name, s->t);
        return KEMPE_SIMULATOR_FAILED;
    }
    s->message[0] = 0;
    kempe_simulator_save(s, s->part.backup);
    kempe_simulator_status status = make_step(s);
    if (status == KEMPE_SIMULATOR_GOES)
        status = step_to(s, state[AT_END]);
    if (status == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
    return status;
}

/* -- changes by the caller ----------------------------------------------------------------------------------- */

/* Starts again from the present state: with other inputs or parameters, loops are closed and conditions decided anew.
 */
static kempe_simulator_status continue_here(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    bool changed = false;
    double t = s->t;
    copy(s->equations->coordinates, s->q, part->q);
    copy(s->equations->coordinates, s->qd, part->qd);
    copy(s->equations->coordinates, s->qd, part->dqd);
    changed = part->state[AT_EVENT] > 0 && !(t < part->state[AT_END]);
    if (changed && !flip_modes(s, t))
        return KEMPE_SIMULATOR_FAILED;
    restart(s, t);
    kempe_simulator_status status = settle_modes(s, t, part->y_new, true, &changed);
    if (status != KEMPE_SIMULATOR_GOES)
        return status;
    pack_y(s, part->q, part->qd, part->y_new);
    part->state[AT_EXCHANGE] = is_choice_bad(s, GROWTH);
    show_place(s, t);
    return part->state[AT_ENDED] > 0 ? end_motion(s) : KEMPE_SIMULATOR_GOES;
}

kempe_simulator_status kempe_simulator_set_inputs(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    int count = 3 * s->equations->inputs;
    bool same = true;
    for (int i = 0; i < count; i++) {
        if (!(fabs(s->u[i]) <= DBL_MAX)) {
            snprintf(s->message, sizeof s->message, "%s: input '%s' is not finite at t = %.9g", s->equations->name,
                     s->equations->input_names[i / 3], s->t);
            copy(count, part->held, s->u);
            return KEMPE_SIMULATOR_FAILED;
        }
        same = same && memcmp(&s->u[i], &part->held[i], sizeof s->u[i]) == 0;
    }
    s->message[0] = 0;
    if (same)
        return KEMPE_SIMULATOR_GOES;
    if (!(part->state[AT_STARTED] > 0)) {
        copy(count, s->u, part->held);
        return KEMPE_SIMULATOR_GOES;
    }
    kempe_simulator_save(s, part->backup);
    copy(count, s->u, part->held);
    kempe_simulator_status status = continue_here(s);
    if (status == KEMPE_SIMULATOR_FAILED) {
        put_back(s, part->backup);
        copy(count, part->held, s->u);
    }
    return status;
}

void kempe_simulator_set_parameters(kempe_simulator *s)
{
    s->message[0] = 0;
    if (s->equations->prepare)
        s->equations->prepare(s->p, s->part.k);
    if (!(s->part.state[AT_STARTED] > 0))
        return;
    kempe_simulator_save(s, s->part.backup);
    if (continue_here(s) == KEMPE_SIMULATOR_FAILED)
        put_back(s, s->part.backup);
}

/* -- for an integrator of the caller -------------------------------------------------------------------------- */

void kempe_simulator_get_states(const kempe_simulator *s, double *x)
{
    copy(2 * s->equations->freedom, s->part.x, x);
}

void kempe_simulator_get_rates(const kempe_simulator *s, double *dx)
{
    copy(2 * s->equations->freedom, s->part.rates, dx);
}

void kempe_simulator_get_choice(const kempe_simulator *s, int *independent)
{
    for (int k = 0; k < s->equations->freedom; k++)
        independent[k] = s->part.column[rank_of(s->equations) + k];
}

void kempe_simulator_get_changes(const kempe_simulator *s, double *value)
{
    const kempe_equations *e = s->equations;
    for (int k = 0; k < e->conditions; k++) {
        double lag = e->lag ? e->lag[k] : 0;
        value[k] =
            e->condition_kind[k] == KEMPE_CONDITION_KINK ? 1 : s->part.value[k] + (s->part.modes[k] > 0 ? -lag : lag);
    }
}

/* Moves the placed, closed q to the independent coordinates u and time t1 in equal parts, each along the tangent of the
 * one before. */
static outcome follow(kempe_simulator *s, double t0, double t1, const double *u, int parts, double *first)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    double *from = part->probe;
    for (int k = 0; k < f; k++)
        from[k] = part->q[part->column[r + k]];
    for (int i = 1; i <= parts; i++) {
        double share = (double)i / parts, dt = (t1 - t0) / parts;
        outcome said = evaluate_loops(s, t0 + (share - 1.0 / parts) * (t1 - t0));
        if (said != GOOD)
            return said;
        for (int k = 0; k < f; k++)
            part->qd[part->column[r + k]] = dt != 0 ? (u[k] - from[k]) / parts / dt : (u[k] - from[k]) / parts;
        if (!(dt != 0))
            clear(e->rows, part->h_t);
        evaluate_rates(s);
        for (int j = 0; j < r; j++)
            part->q[part->column[j]] += part->qd[part->column[j]] * (dt != 0 ? dt : 1);
        for (int k = 0; k < f; k++)
            part->q[part->column[r + k]] = i == parts ? u[k] : from[k] + share * (u[k] - from[k]);
        double size = 0;
        said = close_loops(s, i == parts ? t1 : t0 + share * (t1 - t0), &size);
        *first = fmax(*first, size);
        if (said != GOOD)
            return said;
    }
    return GOOD;
}

kempe_simulator_status kempe_simulator_set_states(kempe_simulator *s, double t, const double *x)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, f = e->freedom, r = rank_of(e);
    if (!(part->state[AT_STARTED] > 0))
        return refuse_before_start(s);
    s->message[0] = 0;
    kempe_simulator_save(s, part->backup);
    copy(3 * e->inputs, s->u, part->held);
    outcome said = OPEN;
    double first = INFINITY;
    for (int parts = 1; parts <= MOST_PARTS && (said != GOOD || first > TRUSTED_CORRECTION); parts *= 4) {
        first = 0;
        copy(n, s->q, part->q);
        said = follow(s, s->t, t, x, parts, &first);
    }
    for (int k = 0; k < f; k++)
        part->qd[part->column[r + k]] = x[f + k];
    if (said == GOOD)
        said = slopes_here(s, t, NULL);
    if (said != GOOD) {
        kempe_simulator_status status = explain(s, said, t);
        put_back(s, part->backup);
        return status;
    }
    complete(s);
    restart(s, t);
    part->state[AT_EXCHANGE] = is_choice_bad(s, GROWTH);
    show_place(s, t);
    return KEMPE_SIMULATOR_GOES;
}

/* Evaluates the present state again where the scratch has another one. */
static outcome refresh(kempe_simulator *s)
{
    struct kempe_simulator_parts *part = &s->part;
    if (*factors_are_present(s) > 0)
        return GOOD;
    copy(s->equations->coordinates, s->q, part->q);
    copy(s->equations->coordinates, s->qd, part->qd);
    outcome said = evaluate_loops(s, s->t);
    if (said == GOOD)
        said = slopes_here(s, s->t, NULL);
    if (said == GOOD) {
        complete(s);
        *factors_are_present(s) = 1;
    }
    return said;
}

int kempe_simulator_wants_exchange(const kempe_simulator *s)
{
    return s->part.state[AT_BAD] > 0;
}

kempe_simulator_status kempe_simulator_update(kempe_simulator *s, int *changed)
{
    struct kempe_simulator_parts *part = &s->part;
    bool any = false;
    *changed = 0;
    if (!(part->state[AT_STARTED] > 0))
        return refuse_before_start(s);
    s->message[0] = 0;
    kempe_simulator_save(s, part->backup);
    copy(s->equations->coordinates, s->q, part->q);
    copy(s->equations->coordinates, s->qd, part->qd);
    restart(s, s->t);
    kempe_simulator_status status = settle_modes(s, s->t, part->y_new, true, &any);
    if (status == KEMPE_SIMULATOR_GOES && is_choice_bad(s, GROWTH_OF_CALLERS)) {
        outcome said = exchange_choice(s, s->t);
        if (said == GOOD)
            said = slopes_here(s, s->t, NULL);
        if (said == GOOD)
            complete(s);
        else
            status = explain(s, said, s->t);
        any = true;
    }
    if (status == KEMPE_SIMULATOR_FAILED) {
        put_back(s, part->backup);
        return status;
    }
    pack_y(s, part->q, part->qd, part->y_new);
    show_place(s, s->t);
    *changed = any;
    return part->state[AT_ENDED] > 0 ? end_motion(s) : KEMPE_SIMULATOR_GOES;
}

/* -- derivatives ---------------------------------------------------------------------------------------------- */

static void call_along(kempe_simulator *s, const kempe_direction *direction)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    kempe_arguments at = arguments_at(s, s->t);
    e->along(&at, direction, part->dynamics, part->dh, part->drates, part->daccelerations, part->dy, part->dvalue);
}

/* dx of v from `rows`: -Jv^-1 rows. */
static void add_dependent(kempe_simulator *s, const double *rows, double *dx)
{
    const struct kempe_simulator_parts *part = &s->part;
    solve_rows(s, rows, part->correction);
    for (int i = 0; i < rank_of(s->equations); i++)
        dx[part->column[i]] = part->correction[i];
}

/* The changes of accelerations and multipliers, by the factors of the motion. */
static void solve_along(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = e->freedom, r = rank_of(e);
    add_constant(s, part->dynamics, part->daccelerations, part->load);
    solve_motion(s, part->load, part->udd, part->correction);
    for (int k = 0; k < f; k++)
        part->dqdd[part->column[r + k]] = part->udd[k];
    for (int i = 0; i < r; i++) {
        double a = part->constant[i];
        for (int k = 0; k < f; k++)
            a += part->tangent[i + k * r] * part->udd[k];
        part->dqdd[part->column[i]] = a;
        part->dlambda[part->row[i]] = part->correction[i];
    }
}

static void hand_out(int count, const double *from, double *to)
{
    if (to)
        copy(count, from, to);
}

kempe_simulator_status kempe_simulator_along(kempe_simulator *s, const kempe_simulator_change *change)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows, f = e->freedom, r = rank_of(e);
    if (!(part->state[AT_STARTED] > 0))
        return refuse_before_start(s);
    if (!e->along) {
        snprintf(s->message, sizeof s->message, "%s: derivatives were not generated", e->name);
        return KEMPE_SIMULATOR_FAILED;
    }
    outcome said = refresh(s);
    if (said != GOOD)
        return explain(s, said, s->t);
    const kempe_direction direction = {change->t,
                                       change->p ? change->p : part->zero,
                                       part->dq,
                                       part->dqd,
                                       part->dqdd,
                                       part->dlambda,
                                       change->u ? change->u : part->zero + e->parameters};
    clear(n, part->dq);
    clear(n, part->dqd);
    clear(n, part->dqdd);
    clear(m, part->dlambda);
    for (int k = 0; change->x && k < f; k++) {
        part->dq[part->column[r + k]] = change->x[k];
        part->dqd[part->column[r + k]] = change->x[f + k];
    }
    if (r > 0) {
        call_along(s, &direction);
        add_dependent(s, part->dh, part->dq);
        call_along(s, &direction);
        add_dependent(s, part->drates, part->dqd);
    }
    call_along(s, &direction);
    solve_along(s);
    if (change->y || change->value)
        call_along(s, &direction);
    for (int k = 0; change->dx && k < f; k++) {
        change->dx[k] = part->dqd[part->column[r + k]];
        change->dx[f + k] = part->dqdd[part->column[r + k]];
    }
    hand_out(n, part->dq, change->q);
    hand_out(n, part->dqd, change->qd);
    hand_out(n, part->dqdd, change->qdd);
    hand_out(m, part->dlambda, change->lambda);
    hand_out(e->outputs, part->dy, change->y);
    hand_out(e->conditions, part->dvalue, change->value);
    return KEMPE_SIMULATOR_GOES;
}
