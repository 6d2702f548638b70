/* SPDX-License-Identifier: BSD-3-Clause */
/* State spaces: one made, its matrices, their file, and their output. */
#include "analyses/linearize/linearize_study.h"
#include "analyses/dense/eigenvalues.h"
#include "analyses/derivatives/delayed_spectrum.h"
#include "analyses/derivatives/sampled_motion.h"
#include "analyses/parts/study_print.h"
#include "base/memory.h"
#include "dynamics/load_dependent.h"
#include "model/data/body.h"
#include "model/data/parameter.h"
#include "model/read/loads.h"
#include "output/named_arrays.h"
#include "output/print.h"
#include <float.h>
#include <kempe/linearize.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* A matrix by its row of matrices.def: its name, the equation that begins with it, its values. */
typedef struct kmp_matrix_row {
    const char *name, *equation;
    const double *values;
    int rows, columns;
} kmp_matrix_row;

static kmp_matrix_row matrix_row(const kempe_linearization *l, int k)
{
    int p = l->count, n = l->channels.transfer.n, width = l->width, second = l->z ? 0 : p;
    int inputs = l->channels.loads.count, outputs = l->channels.outputs.count;
    const kmp_matrix_row row[] = {
#define KMP_MATRIX(name, word, rows, columns, values, equation) {word, equation, values, rows, columns},
#include "analyses/linearize/matrices.def"
#undef KMP_MATRIX
    };
    kmp_matrix_row found = k >= 0 && k < (int)(sizeof row / sizeof *row) ? row[k] : (kmp_matrix_row){0};
    if (l->z && k == KEMPE_MATRIX_A)
        found.equation = "x(k+1) = A x(k) + B w";
    return found;
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status make_first_order(kempe_linearization *l)
{
    const kempe_system *system = l->channels.system;
    const kmp_transfer *t = &l->channels.transfer;
    ptrdiff_t p = t->p, inputs = t->columns, outputs = t->outputs;
    bool made =
        KMP_ARENA_MAKE(&l->channels.arena, KMP_ROOM(double, 4 * p * p, &l->a), KMP_ROOM(double, 2 * p * inputs, &l->b),
                       KMP_ROOM(double, 2 * p * outputs, &l->c), KMP_ROOM(double, outputs *inputs, &l->d));
    int failed = made ? kmp_transfer_first_order(t, l->a, l->b, l->c, l->d) : -1;
    if (failed == -2)
        return kmp_fail(
            system->context, KEMPE_E_FAILED,
            "no state-space model exists at this state, because the accelerations are not unique: forces that depend "
            "on multipliers cancel the inertia of some motion (kempe response needs no such model)");
    KMP_TRY(kmp_made(system->context, failed >= 0));
    if (failed == 0)
        return KEMPE_OK;
    return kmp_fail(system->context, KEMPE_E_FAILED,
                    "no state-space model exists, because the reduced mass is not positive along '%s': give every body "
                    "that moves along it a mass (kempe response needs no such model)",
                    kmp_model_motion(system->model, l->channels.linear.part.u[failed - 1])->name);
}

/* The second-order matrices, without the rows and columns of constant states and delays; what delayed signals do is a
 * load. */
static kempe_status take_second_order(kempe_linearization *l)
{
    const kmp_transfer *t = &l->channels.transfer;
    const kmp_linear *linear = t->linear;
    ptrdiff_t p = t->p, n = t->n;
    int *place = l->u = KMP_ARENA_NEW(&l->channels.arena, int, p), *delay = KMP_ARENA_NEW(&l->channels.arena, int, p);
    KMP_TRY(
        kmp_made(l->channels.system->context,
                 place && delay &&
                     KMP_ARENA_MAKE(&l->channels.arena, KMP_ROOM(double, p *p, &l->mass, &l->damping, &l->stiffness),
                                    KMP_ROOM(double, p *(t->columns + l->delays.count), &l->loads),
                                    KMP_ROOM(double, n *p, &l->map, &l->map_rate))));
    const int moving = kmp_linear_moving(linear, place);
    int count = 0, delays = 0;
    for (int k = 0; k < moving; k++)
        *(kmp_delay_of(linear, place[k]) > 0 ? &delay[delays++] : &place[count++]) = place[k];
    l->count = count;
    kmp_linear_squeeze(t->p, count, place, count, place, linear->mass, l->mass);
    kmp_linear_squeeze(t->p, count, place, count, place, linear->damping, l->damping);
    kmp_linear_squeeze(t->p, count, place, count, place, linear->stiffness, l->stiffness);
    kmp_linear_squeeze(t->p, count, place, t->columns, NULL, t->loads, l->loads);
    kmp_linear_squeeze(t->p, count, place, delays, delay, linear->damping, l->loads + (ptrdiff_t)count * t->columns);
    kmp_linear_squeeze(t->n, t->n, NULL, count, place, t->map, l->map);
    kmp_linear_squeeze(t->n, t->n, NULL, count, place, t->map_rate, l->map_rate);
    for (int k = 0; k < count; k++)
        l->u[k] = linear->part.u[place[k]];
    return KEMPE_OK;
}

/* From one common sample to the next. */
static kempe_status make_samples(kempe_linearization *l)
{
    kempe_context *context = l->channels.system->context;
    ptrdiff_t width = kmp_transfer_width(&l->channels.transfer);
    double *room;
    if (!kmp_samples_in(l->channels.system->model))
        return KEMPE_OK;
    KMP_TRY(kmp_made(context, KMP_ARENA_MAKE(&l->channels.arena, KMP_ROOM(double, 2 * width, &l->z),
                                             KMP_ROOM(double, 3 * width * width, &room))));
    int failed = kmp_transfer_sample(&l->channels.transfer, l->a, l->b, &l->period);
    if (failed)
        return kmp_sampled_complain(context, failed);
    memcpy(room, l->a, (size_t)(width * width) * sizeof *room);
    double *vectors = room + width * width;
    failed = kmp_eigen_general((int)width, room, l->z, l->z + width, vectors, vectors, vectors + width * width,
                               vectors + width * width);
    return failed == 0 ? KEMPE_OK : kmp_sampled_complain(context, failed);
}

/* -- delayed signals ------------------------------------------------------------------------------------- */

/* A state space with delays: the state y of each, whose averaged equation is y' = (u - y)/T, becomes an additional
 * input delay(NAME), and its signal u an additional output of that name, which is this input by T later. */

/* The delay of entry i of x; 0: it is none. */
static double delay_of(const kempe_linearization *l, int i)
{
    const kmp_transfer *t = &l->channels.transfer;
    const int k = kmp_transfer_state(t, i) - t->p;
    return k < 0 ? 0 : kmp_delay_of(t->linear, k);
}

/* -- channels ---------------------------------------------------------------------------------------- */

static bool name_delays(kempe_linearization *l, const int *delay)
{
    kmp_arena *arena = &l->channels.arena;
    const kmp_transfer *t = &l->channels.transfer;
    const kempe_model *model = l->channels.system->model;
    kmp_names *d = &l->delays;
    d->name = KMP_ARENA_NEW(arena, char *, d->count);
    d->unit = KMP_ARENA_NEW(arena, char *, d->count);
    for (int k = 0; !arena->failed && k < d->count; k++) {
        const int motion = t->linear->part.u[kmp_transfer_state(t, delay[k]) - t->p];
        d->name[k] = kmp_arena_printf(arena, "delay(%s)", kmp_model_motion(model, motion)->name);
        d->unit[k] = kmp_arena_strdup(arena, "");
        l->delay[k] = delay_of(l, delay[k]);
    }
    return !arena->failed;
}

/* The entries `kept` (NULL: all) of names, and the delays behind them. */
static bool extend(kempe_linearization *l, kmp_names *names, int count, const int *kept, bool delays)
{
    kmp_arena *arena = &l->channels.arena;
    const kmp_names from = *names;
    const int more = delays ? l->delays.count : 0;
    *names = (kmp_names){count + more, KMP_ARENA_NEW(arena, char *, count + more),
                         KMP_ARENA_NEW(arena, char *, count + more)};
    for (int k = 0; !arena->failed && k < count + more; k++) {
        const kmp_names *of = k < count ? &from : &l->delays;
        const int at = k >= count ? k - count : kept ? kept[k] : k;
        names->name[k] = of->name[at];
        names->unit[k] = of->unit[at];
    }
    return !arena->failed;
}

/* -- matrices ---------------------------------------------------------------------------------------- */

/* A signal before its delay T is y + T y', where y' is the rate of the averaged equations. So a quantity on which y'
 * depends by `rate` has the factor T rate in the signal, and y itself (`own`: 1) has one more. If both cancel, their
 * sum is rounding, and zero is returned. */
static double signal_of(double T, double rate, bool own)
{
    const double sum = T * rate + own;
    return fabs(sum) <= 4 * DBL_EPSILON * own ? 0 : sum;
}

/* Makes the delays inputs and outputs of A, B, C and D, which belong to the averaged system. KEMPE_E_MEMORY. */
static kempe_status open_delays(kempe_linearization *l)
{
    kempe_context *context = l->channels.system->context;
    const kmp_transfer *t = &l->channels.transfer;
    const int width = kmp_transfer_width(t);
    kmp_arena *arena = &l->channels.arena;
    int *kept, *delay, stay = 0; /* entries of x that stay, or are delays */
    double *a, *b, *c, *d, *y;
    l->y = t->value;
    l->width = width;
    if (kmp_model_delay_count(l->channels.system->model) == 0)
        return KEMPE_OK;
    KMP_TRY(kmp_made(context,
                     KMP_ARENA_MAKE(arena, KMP_ROOM(int, width, &kept, &delay), KMP_ROOM(double, width, &l->delay))));
    for (int i = 0; i < width; i++)
        if (delay_of(l, i) > 0)
            delay[l->delays.count++] = i;
        else
            kept[stay++] = i;
    l->width = stay;
    const int outputs = t->outputs, delays = l->delays.count;
    const ptrdiff_t inputs = t->columns + delays, all = outputs + delays, n = stay;
    KMP_TRY(kmp_made(context, KMP_ARENA_MAKE(arena, KMP_ROOM(double, n *n, &a), KMP_ROOM(double, n *inputs, &b),
                                             KMP_ROOM(double, n *all, &c), KMP_ROOM(double, inputs *all, &d),
                                             KMP_ROOM(double, all, &y)) &&
                                  name_delays(l, delay) && extend(l, &l->channels.states, stay, kept, false) &&
                                  extend(l, &l->channels.loads, t->columns, NULL, true) &&
                                  extend(l, &l->channels.outputs, outputs, NULL, true)));
    /* The values of the outputs, and of the signals: at rest the values of the delays. */
    memcpy(y, t->value, (size_t)outputs * sizeof *y);
    for (int k = 0; k < delays; k++)
        y[outputs + k] = t->linear->qd[t->linear->part.u[kmp_transfer_state(t, delay[k]) - t->p]];
    /* All four with the rows of signals after the rows of x, or of the outputs, and the columns of delays after the
     * columns of inputs. */
    for (int j = 0; j < stay + inputs; j++) {
        const bool input = j >= stay && j < stay + t->columns;
        const int x = j < stay ? kept[j] : input ? -1 : delay[j - stay - t->columns], w = j - stay;
        const double *rates = input ? l->b + (ptrdiff_t)w * width : l->a + (ptrdiff_t)x * width;
        const double *seen = input ? l->d + (ptrdiff_t)w * outputs : l->c + (ptrdiff_t)x * outputs;
        double *to_rates = j < stay ? a + j * n : b + w * n, *to_seen = j < stay ? c + j * all : d + w * all;
        for (int i = 0; i < stay; i++)
            to_rates[i] = rates[kept[i]];
        memcpy(to_seen, seen, (size_t)outputs * sizeof *seen);
        for (int i = 0; i < delays; i++)
            to_seen[outputs + i] = signal_of(l->delay[i], rates[delay[i]], delay[i] == x);
    }
    l->y = y;
    l->a = a, l->b = b, l->c = c, l->d = d;
    return KEMPE_OK;
}

/* -- the whole ------------------------------------------------------------------------------------------- */

kempe_status kempe_linearization_new(const kempe_system *system, const kempe_linearize_options *options,
                                     kempe_linearization **linearization)
{
    KMP_WANTED_BOTH(system, linearization);
    KMP_OPTIONS(system->context, kempe_linearize_options, options);
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_linearization, l);
    const kmp_channels_options requested = {options->at,          options->inputs,  options->outputs,
                                            options->independent, options->backend, options->slide};
    kempe_status status = KEMPE_OK;
    if (kmp_samples_in(system->model))
        status = kmp_refuse_delays(system->model, "linear equations of models with samples", KMP_INSTEAD_OF_DELAY);
    if (status == KEMPE_OK)
        status = kmp_channels_init(&l->channels, system, &requested);
    if (status == KEMPE_OK && kmp_model_delay_count(system->model) > 0 && !l->channels.rests)
        status = kmp_fail(system->context, KEMPE_E_ARGUMENT,
                          "the start is not an equilibrium, and linear equations with delays need a past at rest: take "
                          "the state 'equilibrium'");
    if (status == KEMPE_OK)
        status = make_first_order(l);
    if (status == KEMPE_OK)
        status = open_delays(l);
    if (status == KEMPE_OK)
        status = make_samples(l);
    if (status == KEMPE_OK)
        status = take_second_order(l);
    l->channels.warnings = kmp_context_warnings(system->context);
    l->channels.status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_OR_FREE(status, linearization, l, kempe_linearization_free);
}

KMP_FREES(kempe_linearization, l, kmp_channels_free(&l->channels))

/* -- results ----------------------------------------------------------------------------------------- */

const double *kempe_linearization_matrix(const kempe_linearization *l, kempe_matrix matrix, int *rows, int *columns)
{
    KMP_GIVEN(l, NULL);
    kmp_matrix_row row = matrix_row(l, (int)matrix);
    if (rows)
        *rows = row.rows;
    if (columns)
        *columns = row.columns;
    return row.values;
}

static const kmp_names *names_of(const kempe_linearization *l, kempe_channel channel)
{
    static const kmp_names none;
    if ((unsigned)channel > KEMPE_CHANNEL_DELAY)
        return &none;
    return channel == KEMPE_CHANNEL_DELAY   ? &l->delays
           : channel == KEMPE_CHANNEL_STATE ? &l->channels.states
           : channel == KEMPE_CHANNEL_INPUT ? &l->channels.loads
                                            : &l->channels.outputs;
}

KMP_GETTER(int kempe_linearization_count(const kempe_linearization *l, kempe_channel channel), l,
           names_of(l, channel)->count, 0)
KMP_GETTER_AT(const char *kempe_linearization_name(const kempe_linearization *l, kempe_channel channel, int k), l, k,
              names_of(l, channel)->count, names_of(l, channel)->name[k], "")
KMP_GETTER_AT(const char *kempe_linearization_unit(const kempe_linearization *l, kempe_channel channel, int k), l, k,
              names_of(l, channel)->count, names_of(l, channel)->unit[k], "")
KMP_GETTER(const double *kempe_linearization_q(const kempe_linearization *l), l, l->channels.at->q, NULL)
KMP_GETTER(const double *kempe_linearization_qd(const kempe_linearization *l), l, l->channels.at->qd, NULL)
KMP_GETTER(const double *kempe_linearization_y(const kempe_linearization *l), l, l->y, NULL)
KMP_GETTER_AT(double kempe_linearization_delay(const kempe_linearization *l, int k), l, k, l->delays.count, l->delay[k],
              0)
KMP_GETTER(double kempe_linearization_sample_time(const kempe_linearization *l), l, l->period, 0)
KMP_GETTER(int kempe_linearization_is_equilibrium(const kempe_linearization *l), l, l->channels.rests, 0)

/* -- files ---------------------------------------------------------------------------------------- */

static void add_names(kmp_arrays *arrays, const char *names, const char *units, const kmp_names *of)
{
    kmp_arrays_words(arrays, names, of->count, of->name);
    kmp_arrays_words(arrays, units, of->count, of->unit);
}

kempe_status kempe_linearization_write(const kempe_linearization *l, const char *path)
{
    KMP_WANTED(NULL, l, "linearization");
    KMP_WANTED(l->channels.linear.system->context, path, "path");
    const kmp_channels *c = &l->channels;
    const kempe_system *system = c->system;
    int n = system->n;
    kmp_arrays arrays = {0};
    kmp_context_clear(system->context);
    char **coordinates = KMP_NEW(char *, n);
    arrays.failed = !coordinates;
    for (int k = 0; k < KMP_MATRICES; k++) {
        kmp_matrix_row row = matrix_row(l, k);
        if (k != KEMPE_MATRIX_Z || l->z)
            kmp_arrays_matrix(&arrays, row.name, row.rows, row.columns, row.values);
    }
    add_names(&arrays, "states", "state_units", &c->states);
    add_names(&arrays, "inputs", "input_units", &c->loads);
    add_names(&arrays, "outputs", "output_units", &c->outputs);
    if (l->delays.count > 0) {
        kmp_arrays_words(&arrays, "delays", l->delays.count, l->delays.name);
        kmp_arrays_matrix(&arrays, "delay_times", l->delays.count, KMP_ARRAY_VECTOR, l->delay);
    }
    for (int k = 0; coordinates && k < n; k++)
        coordinates[k] = (char *)kmp_model_motion(system->model, k)->name; /* read only */
    if (coordinates)
        kmp_arrays_words(&arrays, "coordinates", n, coordinates);
    kmp_arrays_matrix(&arrays, "q", n, KMP_ARRAY_VECTOR, c->at->q);
    kmp_arrays_matrix(&arrays, "qd", n, KMP_ARRAY_VECTOR, c->at->qd);
    kmp_arrays_matrix(&arrays, "y", c->outputs.count, KMP_ARRAY_VECTOR, l->y);
    kempe_status status = kmp_arrays_write(system->context, &arrays, path);
    kmp_free(coordinates);
    return status;
}

/* -- text -------------------------------------------------------------------------------------------- */

enum { MOST_ROWS = 24, MOST_NAMES = 24, MOST_FIRST = 8, INDENT = 4, CELL = 32 };

static const char *state_sentence(const kmp_channels *c)
{
    return c->at->equilibrium ? (c->goes_on ? "about the steady motion" : "at the equilibrium")
           : c->goes_on       ? "at the start, which is a steady motion"
           : c->rests         ? "at the start, which is an equilibrium"
                              : "at the start, which is not an equilibrium";
}

/* Names with their units: the `whole` list, or the first ones of many. */
static void list(kmp_text *text, const char *what, const char *symbol, const kmp_names *names, bool whole)
{
    const int shown = whole || names->count <= MOST_NAMES ? names->count : MOST_FIRST;
    kmp_text first = {0}, all = {0};
    if (names->count == 0)
        return;
    kmp_text_printf(&first, "  %d %s%s %s: ", names->count, what, names->count == 1 ? "" : "s", symbol);
    for (int k = 0; k < shown; k++)
        kmp_text_printf(&all, "%s%s%s%s%s", k ? ", " : "", names->name[k], names->unit[k][0] ? " [" : "",
                        names->unit[k], names->unit[k][0] ? "]" : "");
    if (shown < names->count)
        kmp_text_put(&all, ", ..");
    kmp_print_wrapped(text, first.s ? first.s : "", INDENT, all.s ? all.s : "");
    kmp_text_free_part(text, &first);
    kmp_text_free_part(text, &all);
}

/* An entry with six digits; rounding of the largest one as 0. */
static int put_cell(char cell[CELL], const kmp_matrix_row *m, int i, int k)
{
    double largest = 0;
    for (ptrdiff_t e = 0; e < (ptrdiff_t)m->rows * m->columns; e++)
        largest = fmax(largest, fabs(m->values[e]));
    return snprintf(cell, CELL, "%.6g", kmp_print_clean(m->values[i + (ptrdiff_t)k * m->rows], DBL_EPSILON * largest));
}

static int column_width(const kmp_matrix_row *m, int k)
{
    char cell[CELL];
    int width = 0;
    for (int i = 0; i < m->rows; i++) {
        const int length = put_cell(cell, m, i, k);
        width = length > width ? length : width;
    }
    return width + 2;
}

/* Matrices with equal numbers of rows, one next to the other. */
static int group_width(int count, const kmp_matrix_row *m)
{
    int width = 0;
    for (; count > 0; m++, count--) {
        width += m->columns > 0 ? (width > 0 ? 4 : 2) + (int)strlen(m->name) : 0;
        for (int k = 0; k < m->columns; k++)
            width += column_width(m, k);
    }
    return width;
}

static void show_beside(kmp_text *text, int count, const kmp_matrix_row *m)
{
    char cell[CELL];
    for (int i = 0; i < m->rows; i++) {
        for (const kmp_matrix_row *one = m; one < m + count; one++) {
            if (one->columns > 0)
                kmp_text_printf(text, "%s%-*s", one > m ? "    " : "  ", (int)strlen(one->name),
                                i == 0 ? one->name : "");
            for (int k = 0; k < one->columns; k++) {
                put_cell(cell, one, i, k);
                kmp_text_printf(text, "%*s", column_width(one, k), cell);
            }
        }
        kmp_text_put(text, "\n");
    }
}

/* A matrix that is too wide for a line, by blocks of columns. */
static void show_blocks(kmp_text *text, const kmp_matrix_row *m)
{
    for (int from = 0, to; from < m->columns; from = to) {
        kmp_matrix_row part = *m;
        part.values = m->values + (ptrdiff_t)from * m->rows;
        for (to = from + 1; to < m->columns; to++) {
            part.columns = to + 1 - from;
            if (group_width(1, &part) > KMP_PRINT_LINE)
                break;
        }
        part.columns = to - from;
        kmp_text_printf(text, "  %s, columns %d to %d of %d\n", m->name, from + 1, to, m->columns);
        part.name = "";
        show_beside(text, 1, &part);
    }
}

/* An equation, without its term of the inputs where there are none; the one of second order with its coordinates. */
static void put_equation(kmp_text *text, const kempe_linearization *l, int first, const char *equation)
{
    kmp_text words = {0};
    for (const char *at = equation; *at; at++)
        if (l->channels.loads.count == 0 && strncmp(at, " + ", 3) == 0 && strncmp(at + 4, " w", 2) == 0)
            at += strlen(" + B w") - 1;
        else
            kmp_text_printf(&words, "%c", *at);
    if (first == KEMPE_MATRIX_M) {
        kmp_text_put(&words, " with u = ");
        kmp_list_names(&words, l->channels.system, kmp_name_of_coordinate, l->count, l->u);
    }
    kmp_text_put(text, "\n");
    kmp_print_wrapped(text, "", INDENT, words.s ? words.s : "");
    kmp_text_free_part(text, &words);
}

/* Matrices next to each other below their equation, or, all of them, one below the other. False: they are too large,
 * and not shown. */
static bool show_group(kmp_text *text, const kempe_linearization *l, int first, int count, bool all)
{
    kmp_matrix_row m[KMP_MATRICES] = {0};
    int columns = 0;
    for (int k = 0; k < count; k++) {
        m[k] = matrix_row(l, first + k);
        columns += m[k].columns;
    }
    if (m->rows == 0 || columns == 0)
        return true;
    const bool fits = m->rows <= MOST_ROWS && group_width(count, m) <= KMP_PRINT_LINE;
    if (fits || all)
        put_equation(text, l, first, m->equation);
    if (fits)
        show_beside(text, count, m);
    for (int k = 0; k < count && !fits && all; k++)
        show_blocks(text, &m[k]);
    return fits || all;
}

static double largest_of(const kempe_linearization *l)
{
    kmp_matrix_row z = matrix_row(l, KEMPE_MATRIX_Z);
    double largest = 0;
    for (int k = 0; k < z.rows; k++)
        largest = fmax(largest, hypot(z.values[k], z.values[k + z.rows]));
    return largest;
}

static void show_parts(kmp_text *text, const kempe_linearization *l, bool all)
{
    const kmp_channels *c = &l->channels;
    kmp_text title = {0};
    kmp_print_title(&title, c->system->model, kmp_outcome_of(c->status));
    if (c->states.count > 0)
        kmp_text_printf(&title, "state-space model %s%s", state_sentence(c),
                        kmp_model_has_time(c->system->model) ? " (t = 0)" : "");
    else
        kmp_text_put(&title, "no states: the mechanism has no degree of freedom");
    kmp_print_answer(text, &title, kmp_outcome_of(c->status), c->warnings, "", NULL);
    if (!c->rests && !c->goes_on)
        kmp_text_put(text, "  It is valid only near this state, for a short time\n");
    if (l->period > 0)
        kmp_text_printf(text, "  samples every %.6g s; largest |z| %.6g: %s\n", l->period, largest_of(l),
                        largest_of(l) < 1   ? "stable"
                        : largest_of(l) > 1 ? "unstable"
                                            : "neutral");
    kmp_averaged_put(text, "  tracks: ", c->averaged);
    kmp_print_held(text, "  held: ", c->system, c->at->qd);
    list(text, "state", "x", &c->states, all);
    list(text, "input", "w", &c->loads, all);
    list(text, "output", "y", &c->outputs, all);
    for (int k = 0; k < l->delays.count; k++) {
        kmp_shown as = kmp_shown_as(c->system->context, "s");
        kmp_text_printf(text, "  input %s is the output of that name %.6g %s before\n", l->delays.name[k],
                        as.factor * l->delay[k], as.unit);
    }
    /* The independent coordinates suffice for a reader: the others are details. */
    bool whole = all || l->channels.states.count <= MOST_NAMES;
    if (!all && l->channels.states.count == 0)
        return;
    for (int first = 0, next; first < (all ? KMP_MATRICES : (int)KEMPE_MATRIX_N); first = next) {
        for (next = first + 1; next < KMP_MATRICES && !*matrix_row(l, next).equation;)
            next++;
        whole = show_group(text, l, first, next - first, all) && whole;
    }
    if (!all)
        kmp_text_printf(text, "\nMore (%sN and Nd of all coordinates): --all, -o FILE.npz, --json\n",
                        whole ? "" : "all names, large matrices, ");
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void json_names(kmp_json *j, const char *key, const kmp_names *names)
{
    kmp_json_array(j, key);
    for (int k = 0; k < names->count; k++)
        kmp_json_put(j, "{ name %s unit %s }", names->name[k], names->unit[k]);
    kmp_json_end(j);
}

/* One array per row. */
static void json_matrix(kmp_json *j, const kmp_matrix_row *row)
{
    double *room = KMP_NEW(double, row->columns);
    j->text->failed = j->text->failed || !room;
    kmp_json_array(j, row->name);
    for (int i = 0; room && i < row->rows; i++) {
        for (int k = 0; k < row->columns; k++)
            room[k] = row->values[i + k * row->rows] + 0.0;
        kmp_json_numbers(j, NULL, row->columns, room);
    }
    kmp_json_end(j);
    kmp_free(room);
}

static void json(kmp_text *text, const void *result)
{
    const kempe_linearization *l = result;
    const kmp_channels *c = &l->channels;
    kmp_json j = kmp_print_head(text, c->system, kmp_outcome_of(c->status), "", c->build_s, c->warnings);
    kmp_json_put(&j, "at %s state %s residual %g", c->at->equilibrium ? "equilibrium" : "start",
                 c->goes_on ? "steady"
                 : c->rests ? "rests"
                            : "moves",
                 c->residual);
    kmp_print_names(&j, "u", c->system, kmp_name_of_coordinate, l->count, l->u);
    kmp_print_entries(&j, "q", c->system, KMP_QUANTITY_Q, c->at->q);
    kmp_print_entries(&j, "qd", c->system, KMP_QUANTITY_QD, c->at->qd);
    if (l->period > 0)
        kmp_json_number(&j, "sample_time", l->period);
    kmp_print_held_json(&j, c->system, c->at->qd);
    json_names(&j, "states", &c->states);
    json_names(&j, "inputs", &c->loads);
    json_names(&j, "outputs", &c->outputs);
    if (l->delays.count > 0) {
        kmp_json_array(&j, "delays");
        for (int k = 0; k < l->delays.count; k++)
            kmp_json_put(&j, "{ name %s time %g }", l->delays.name[k], l->delay[k]);
        kmp_json_end(&j);
    }
    kmp_json_numbers(&j, "y", c->outputs.count, l->y);
    for (int k = 0; k < KMP_MATRICES; k++) {
        kmp_matrix_row row = matrix_row(l, k);
        if (k != KEMPE_MATRIX_Z || l->z)
            json_matrix(&j, &row);
    }
    kmp_json_end(&j);
}

KMP_PRINT_FULL(kempe_linearization, linearization, linearization->channels.system->context, json, show_parts)
