/* SPDX-License-Identifier: BSD-3-Clause */
/* State spaces: one made, its matrices, and their file. */
#include "studies/linearize/linearize_study.h"
#include "base/memory.h"
#include "derivatives/delayed_motion.h"
#include "derivatives/sampled_motion.h"
#include "dynamics/load_dependent.h"
#include "linalg/dense/lapack.h"
#include "output/formats/named_arrays.h"
#include <kempe/linearize.h>
#include <math.h>
#include <string.h>

kmp_matrix_row kmp_linearization_row(const kempe_linearization *l, int k)
{
    int p = l->count, n = l->channels.transfer.n, width = l->width, second = l->z ? 0 : p;
    int inputs = l->channels.loads.count, outputs = l->channels.outputs.count;
    const kmp_matrix_row row[] = {
#define KMP_MATRIX(name, word, rows, columns, values, meaning) {word, meaning, values, rows, columns},
#include "studies/linearize/matrices.def"
#undef KMP_MATRIX
    };
    kmp_matrix_row found = k >= 0 && k < (int)(sizeof row / sizeof *row) ? row[k] : (kmp_matrix_row){0};
    if (l->z && k == KEMPE_MATRIX_A)
        found.meaning = "x(k+1) = A x(k) + B w(k)";
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
        return kmp_fail(system->context, KEMPE_E_FAILED,
                        "the state does not determine the accelerations: forces that depend on multipliers cancel the "
                        "inertia of some motion, and there is no state-space model (kempe response needs none)");
    KMP_TRY(kmp_made(system->context, failed >= 0));
    if (failed == 0)
        return KEMPE_OK;
    return kmp_fail(system->context, KEMPE_E_FAILED,
                    "the reduced mass is not positive along '%s': there is no state-space model (kempe response needs "
                    "none); give every body that moves along it a mass",
                    system->model->motions[l->channels.linear.part.u[failed - 1]].name);
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

kempe_status kempe_linearization_new(const kempe_system *system, const kempe_linearize_options *options,
                                     kempe_linearization **linearization)
{
    KMP_WANTED_BOTH(system, linearization);
    KMP_OPTIONS(system->context, kempe_linearize_options, options);
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_linearization, l);
    const kmp_channels_options requested = {options->at, options->inputs, options->outputs, options->independent,
                                            options->backend};
    kempe_status status = KEMPE_OK;
    if (kmp_samples_in(system->model))
        status = kmp_refuse_delays(system->model, "linear equations of models with samples", KMP_INSTEAD_OF_DELAY);
    if (status == KEMPE_OK)
        status = kmp_channels_init(&l->channels, system, &requested);
    if (status == KEMPE_OK)
        status = kmp_linearization_check_delays(l);
    if (status == KEMPE_OK)
        status = make_first_order(l);
    if (status == KEMPE_OK)
        status = kmp_linearization_open_delays(l);
    if (status == KEMPE_OK)
        status = make_samples(l);
    if (status == KEMPE_OK)
        status = take_second_order(l);
    l->channels.warnings = kmp_context_warnings(system->context);
    l->channels.status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_OR_FREE(status, linearization, l, kempe_linearization_free);
}

void kempe_linearization_free(kempe_linearization *l)
{
    if (!l)
        return;
    kmp_channels_free(&l->channels);
    kmp_free(l);
}

/* -- results ----------------------------------------------------------------------------------------- */

const double *kempe_linearization_matrix(const kempe_linearization *l, kempe_matrix matrix, int *rows, int *columns)
{
    KMP_GIVEN(l, NULL);
    kmp_matrix_row row = kmp_linearization_row(l, (int)matrix);
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
        kmp_matrix_row row = kmp_linearization_row(l, k);
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
        coordinates[k] = (char *)system->model->motions[k].name; /* read only */
    if (coordinates)
        kmp_arrays_words(&arrays, "coordinates", n, coordinates);
    kmp_arrays_matrix(&arrays, "q", n, KMP_ARRAY_VECTOR, c->at->q);
    kmp_arrays_matrix(&arrays, "qd", n, KMP_ARRAY_VECTOR, c->at->qd);
    kmp_arrays_matrix(&arrays, "y", c->outputs.count, KMP_ARRAY_VECTOR, l->y);
    kempe_status status = kmp_arrays_write(system->context, &arrays, path);
    kmp_free(coordinates);
    return status;
}
