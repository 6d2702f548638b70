/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers, memory and structure of a simulator. A part of kempe_simulator.c. */
#pragma once

#include "base/bracket.h"
#include "exchange/simulator/kempe_simulator.h"
#include "integrators/decide/closing.h"
#include "integrators/decide/conditions.h"
#include "integrators/decide/coordinate_exchange.h"
#include "integrators/decide/dropped_rows.h"
#include "integrators/decide/endless_growth.h"
#include "integrators/decide/event_location.h"
#include "integrators/decide/restart.h"
#include "integrators/decide/run_start.h"
#include "integrators/decide/step_control.h"
#include "integrators/steppers/explicit_methods.h"
#include "integrators/steppers/sample_times.h"
#include "linalg/dense/factors.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST_LOADS = 50, MOST_PARTS = 256, MOST_HALVINGS = 24 };

/* Numbers that a structure fills. */
#define KEMPE_NUMBERS_OF(type) ((sizeof(type) + sizeof(double) - 1) / sizeof(double))

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
    AT_COARSE,   /* they are too inexact: further steps take their place */
    AT_FRESH,    /* the derivative at the end is not there */
    AT_EVENT,    /* modes change at the end, by `flip` */
    AT_EXCHANGE, /* the choice is bad at the end */
    AT_ENDED,    /* 1 + the condition that ends the motion at the end; 0 */
    AT_SIGN,     /* of det Jv, block by block */
    AT_RATE,     /* of the motion at the start, 1/s */
    AT_LOOSE,    /* largest h of a redundant row at the start */
    AT_STARTED,
    AT_BAD, /* the choice is bad at the present state for an integrator of the caller */
    AT_SETTINGS,
    AT_WORK = AT_SETTINGS + KEMPE_NUMBERS_OF(kempe_simulator_settings),
    AT_RANK = AT_WORK + KEMPE_NUMBERS_OF(kempe_simulator_work),
    AT_TRIED,                                                /* attempted steps since the start */
    AT_GROWTH,                                               /* numbers of kmp_growth */
    AT_CORRECTED = AT_GROWTH + KEMPE_NUMBERS_OF(kmp_growth), /* numbers of kmp_last_correction */
    AT_PAST_CORRECTED = AT_CORRECTED + KEMPE_NUMBERS_OF(kmp_last_correction),
    HEADER = 48
};

/* Results of an evaluation. */
typedef enum outcome {
    GOOD,
    OPEN,
    SINGULAR_LOOPS,
    SINGULAR_MASS,
    NOT_FINITE,
    UNSETTLED,
    UNBALANCED,
    MOVED_ANGLES,
    REPORTED
} outcome;

typedef char kinds_are_those[(int)KMP_CONDITION_VALIDITY == KEMPE_CONDITION_VALIDITY ? 1 : -1];
typedef char header_fits[AT_PAST_CORRECTED <= HEADER ? 1 : -1];

/* Sets the message: the name of the mechanism, then a sentence. */
#ifdef __GNUC__
__attribute__((format(printf, 2, 3)))
#endif
static kempe_simulator_status
fail_with(kempe_simulator *s, const char *format, ...)
{
    va_list arguments;
    int used = snprintf(s->message, sizeof s->message, "%s: ", s->equations->name);
    used = used < (int)sizeof s->message ? used : (int)sizeof s->message - 1;
    va_start(arguments, format);
    vsnprintf(s->message + used, sizeof s->message - (size_t)used, format, arguments);
    va_end(arguments);
    return KEMPE_SIMULATOR_FAILED;
}

static const kmp_rk_numbers methods[] = {KMP_DOP853_NUMBERS, KMP_DOPRI5_NUMBERS};

/* -- memory: places of arrays, saving and restoring ------------------------------------------------------ */

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

static void take_each(double **at, int count, double **const *arrays)
{
    for (; *arrays; arrays++)
        **arrays = take(at, count);
}

static void take_each_of_indices(double **at, int count, int **const *arrays)
{
    for (; *arrays; arrays++)
        **arrays = take_indices(at, count);
}

/* Places arrays of one size. */
#define TAKE(count, ...)         take_each(at, count, (double **const[]){__VA_ARGS__, NULL})
#define TAKE_INDICES(count, ...) take_each_of_indices(at, count, (int **const[]){__VA_ARGS__, NULL})

/* Rows that are kept, and coordinates that are free. */
static int rank_of(const kempe_simulator *s)
{
    return s->part.rank;
}

static int freedom_of(const kempe_simulator *s)
{
    return s->equations->coordinates - s->part.rank;
}

static int size_of_y(const kempe_simulator *s)
{
    return s->equations->coordinates + freedom_of(s);
}

/* The rank without rows that conditions add: the memory of the states of callers. */
static int least_rank(const kempe_equations *e)
{
    return e->coordinates - e->freedom;
}

/* At the least rank. */
static int most_of_y(const kempe_equations *e)
{
    return e->coordinates + e->freedom;
}

static void place_state(kempe_simulator *s, double **at)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows, size = most_of_y(e);
    part->state = take(at, HEADER);
    s->p = take(at, e->parameters);
    TAKE(3 * e->inputs, &s->u, &part->held);
    part->held_p = take(at, e->parameters);
    part->k = take(at, e->kept);
    TAKE(n, &s->q, &s->qd, &s->qdd);
    s->lambda = take(at, m);
    s->y = take(at, e->outputs);
    TAKE(e->conditions, &part->modes, &part->value, &part->flip, &part->last, &part->repeats, &part->largest,
         &part->most);
    TAKE(e->discrete.states, &part->number, &part->was, &part->due);
    TAKE(3 * n + m, &part->begin, &part->end);
    TAKE(size, &part->y_old, &part->y_new, &part->weight, &part->atol);
    part->stages = take(at, KMP_RK_MAX_STAGES * size);
    part->vectors = take(at, KMP_RK_MAX_INTERPOLANTS * size);
    part->row = take_indices(at, m);
    part->column = take_indices(at, n);
    part->decisions = take(at, e->friction ? KEMPE_SIMULATOR_FRICTION_STATE(e->friction->elements) : 0);
    part->inner_q = s->q; /* without charts the motion has the coordinates of the caller */
    part->inner_qd = s->qd;
    part->inner_qdd = s->qdd;
    if (!e->charts)
        return;
    part->chart = take(at, 9 * e->charts->joints);
    part->seen = take(at, 3 * e->charts->joints);
    part->seen_t = take(at, 1);
    TAKE(n, &part->inner_q, &part->inner_qd, &part->inner_qdd);
}

/* The arrays of a step from y_old to the stages. */
static int numbers_of_step(const kempe_equations *e)
{
    return (4 + KMP_RK_MAX_STAGES) * most_of_y(e);
}

/* Numbers of decisions on impacts, which lie in the room of the decisions on friction. */
static int numbers_of_contacts(const kempe_equations *e)
{
    return e->friction && e->friction->contacts > 0 ? KEMPE_SIMULATOR_CONTACTS(e->coordinates, e->friction->elements)
                                                    : 0;
}

static int numbers_of_watch(const kempe_equations *e)
{
    const kempe_watch *w = e->watch;
    return w ? KEMPE_SIMULATOR_WATCH(e->conditions, w->constants + w->inputs + w->steps, w->inputs, w->solved) : 0;
}

static void place_scratch(kempe_simulator *s, double **at)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int n = e->coordinates, m = e->rows, f = e->freedom, r = least_rank(e) + (e->friction ? e->friction->elements : 0);
    part->scratch = take(at, 1);
    TAKE(2 * f, &part->x, &part->rates);
    TAKE(most_of_y(e), &part->stage, &part->candidate, &part->probe);
    part->aside = take(at, HEADER + numbers_of_step(e));
    TAKE(n, &part->q, &part->qd, &part->qdd, &part->bias, &part->load, &part->right);
    TAKE(m, &part->lambda, &part->h, &part->h_t, &part->jdqd, &part->pivots, &part->inverse_row);
    part->changes = take(at, 2 * e->conditions);
    part->next = take(at, e->discrete.states);
    TAKE(m * n, &part->jacobian, &part->pick);
    TAKE(n * n, &part->mass, &part->joint);
    part->loop = take(at, r * r);
    part->tangent = take(at, r * (f + 1));
    TAKE(r, &part->constant, &part->correction);
    part->moved = take(at, n * f);
    part->reduced = take(at, f * f);
    TAKE(f, &part->diagonal, &part->udd);
    part->loads = take(at, n * r);
    TAKE_INDICES(n, &part->pivot, &part->joint_pivot, &part->new_column, &part->fixed, &part->column_mark);
    TAKE_INDICES(m, &part->new_row, &part->row_mark);
    TAKE_INDICES(n + 1, &part->block, &part->mass_begin);
    part->touch_begin = take_indices(at, f + 1);
    part->touch = take_indices(at, f * r);
    part->mass_at = take_indices(at, n * n);
    TAKE(n, &part->dq, &part->dqd, &part->dqdd, &part->dynamics);
    TAKE(m, &part->dlambda, &part->dh, &part->drates, &part->daccelerations);
    part->dy = take(at, e->outputs);
    part->dvalue = take(at, e->conditions);
    part->zero = take(at, e->parameters + 3 * e->inputs);
    if (e->friction) {
        TAKE(n, &part->site_q, &part->site_qd);
        part->site_room =
            take(at, KEMPE_SIMULATOR_FRICTION_ROOM(e->conditions, e->friction->elements) + numbers_of_contacts(e));
        part->last_pivot = take(at, 1);
    }
    part->watched = take(at, numbers_of_watch(e));
    part->next_seen = take(at, e->charts ? 3 * e->charts->joints : 0);
    part->seen_q = take(at, e->charts ? e->coordinates : 0);
    part->end_of_memory = *at;
}

int kempe_simulator_memory(const kempe_equations *e)
{
    int numbers = KEMPE_SIMULATOR_MEMORY(e->coordinates, e->rows, e->freedom, e->inputs, e->parameters, e->kept,
                                         e->conditions, e->outputs, e->discrete.states) +
                  numbers_of_watch(e);
    if (e->charts)
        numbers += KEMPE_SIMULATOR_CHARTS(e->coordinates, e->charts->joints);
    if (e->friction)
        numbers += numbers_of_contacts(e) +
                   KEMPE_SIMULATOR_FRICTION(e->coordinates, e->rows, e->freedom, e->conditions, e->friction->elements);
    return numbers;
}

int kempe_simulator_saved_numbers(const kempe_simulator *s)
{
    return (int)(s->part.backup - s->part.state);
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

/* The equations have the present inputs and parameters. */
static void hold_arguments(kempe_simulator *s)
{
    copy(3 * s->equations->inputs, s->u, s->part.held);
    copy(s->equations->parameters, s->p, s->part.held_p);
    if (s->equations->prepare)
        s->equations->prepare(s->p, s->part.k);
}

static double *chart_of(const kempe_simulator *s, int c)
{
    return s->part.chart + 9 * (ptrdiff_t)c;
}

/* True where angles count from the model's orientation. */
static bool is_own(const double *chart)
{
    bool own = true;
    for (int k = 0; k < 9; k++)
        own = own && chart[k] == (k % 4 == 0);
    return own;
}

static bool charts_have_moved(const kempe_simulator *s)
{
    bool moved = false;
    for (int c = 0; s->equations->charts && c < s->equations->charts->joints; c++)
        moved = moved || !is_own(chart_of(s, c));
    return moved;
}

static void reset_charts(kempe_simulator *s)
{
    for (int k = 0; s->equations->charts && k < 9 * s->equations->charts->joints; k++)
        s->part.chart[k] = k % 9 % 4 == 0;
}

static void list_mass(kempe_simulator *s);
static void find_structure(kempe_simulator *s);

void kempe_simulator_init(kempe_simulator *s, const kempe_equations *e, double *memory)
{
    memset(s, 0, sizeof *s);
    s->equations = e;
    s->memory = memory;
    s->numbers = kempe_simulator_memory(e);
    s->part.rank = least_rank(e);
    memset(memory, 0, (size_t)s->numbers * sizeof *memory);
    double *at = memory;
    place_state(s, &at);
    s->part.backup = take(&at, (int)(at - memory));
    place_scratch(s, &at);
    s->settings.method = KEMPE_METHOD_DOP853;
    s->settings.rtol = s->settings.atol = 1e-8;
    s->settings.longest = e->longest;
    s->settings.end = INFINITY;
    copy(e->parameters, e->parameter_values, s->p);
    copy(3 * e->inputs, e->input_values, s->u);
    for (int i = 0; i < e->rows; i++)
        s->part.inverse_row[i] = 1 / e->row_scale[i];
    hold_arguments(s);
    for (int i = 0; i < e->rows; i++)
        s->part.row[i] = i;
    for (int j = 0; j < e->coordinates; j++)
        s->part.column[j] = j;
    reset_charts(s);
    list_mass(s);
    find_structure(s);
}

/* The factors in the scratch belong to the present state. */
static double *factors_are_present(kempe_simulator *s)
{
    return s->part.scratch;
}

void kempe_simulator_save(const kempe_simulator *s, double *to)
{
    copy(kempe_simulator_saved_numbers(s), s->part.state, to);
    to[AT_T] = s->t;
    memcpy(to + AT_SETTINGS, &s->settings, sizeof s->settings);
    memcpy(to + AT_WORK, &s->work, sizeof s->work);
    to[AT_RANK] = s->part.rank;
}

/* Except for the message. */
static void put_back(kempe_simulator *s, const double *from)
{
    copy(kempe_simulator_saved_numbers(s), from, s->part.state);
    s->t = from[AT_T];
    memcpy(&s->settings, from + AT_SETTINGS, sizeof s->settings);
    memcpy(&s->work, from + AT_WORK, sizeof s->work);
    s->part.rank = (int)from[AT_RANK];
    *factors_are_present(s) = 0;
    find_structure(s);
}

/* The states of callers: the rows of the least rank, of which the first are dependent where it is larger. */
static void take_states(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    for (int k = 0; k < e->freedom; k++) {
        int c = s->part.column[least_rank(e) + k];
        s->part.x[k] = s->part.inner_q[c];
        s->part.x[e->freedom + k] = s->part.rates[k] = s->part.inner_qd[c];
        s->part.rates[e->freedom + k] = s->part.inner_qdd[c];
    }
}

void kempe_simulator_restore(kempe_simulator *s, const double *from)
{
    put_back(s, from);
    s->message[0] = 0;
    take_states(s);
}

/* -- entries of J and M that can be nonzero, and independent blocks of loops ----------------------------- */

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
    int r = rank_of(s);
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

static bool contains(int count, const int *list, int entry)
{
    for (int i = 0; i < count; i++)
        if (list[i] == entry)
            return true;
    return false;
}

/* The slopes of the equations for the choice, which hold in the model's own angles; NULL: there are none. */
static const kempe_slopes *find_slopes(const kempe_simulator *s)
{
    const int r = rank_of(s);
    if (charts_have_moved(s))
        return NULL;
    for (int k = 0; r == least_rank(s->equations) && k < s->equations->slopes_count; k++) {
        const kempe_slopes *slopes = &s->equations->slopes[k];
        bool fits = true;
        for (int i = 0; i < r && fits; i++)
            fits = contains(r, slopes->dependent, s->part.column[i]) && contains(r, slopes->rows, s->part.row[i]);
        if (fits)
            return slopes;
    }
    return NULL;
}

/* Orders the choice by loops that have no coordinate in common: blocks of Jv, one after another. Lists the blocks that
 * move with each independent coordinate. The order depends only on the choice. */
static void find_structure(kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    int f = freedom_of(s), r = rank_of(s), count = 0;
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
    part->slopes = find_slopes(s);
}
