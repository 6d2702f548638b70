/* SPDX-License-Identifier: BSD-3-Clause */
/* The piece of each input that holds now: a polynomial of samples, one that a caller gave, or a part of a delayed
 * signal's past. Pieces change between steps only; times that differ by rounding are one. */
#include "constraints/evaluation/present_inputs.h"
#include "model/data/model.h"
#include <math.h>
#include <string.h>

bool kmp_present_inputs_init(kmp_present_inputs *inputs, kmp_arena *arena, const kempe_model *model)
{
    *inputs = (kmp_present_inputs){.model = model, .count = model->input_count};
    if (!KMP_ARENA_MAKE(arena, KMP_ROOM(kmp_signal_piece, inputs->count, &inputs->piece, &inputs->given),
                        KMP_ROOM(bool, inputs->count, &inputs->replaced, &inputs->waits),
                        KMP_ROOM(double, kmp_present_inputs_size(inputs), &inputs->vector)))
        return false;
    for (int k = 0; k < inputs->count; k++)
        inputs->piece[k] = kmp_signal_at(&model->inputs[k].signal, 0);
    return true;
}

/* -- delayed signals --------------------------------------------------------------------------------- */

/* A part of the past without jumps is a piece like others: its `c` has the numbers of its first and last polynomial,
 * and the order of the derivative of the signal that jumps where it begins. */
enum { FIRST, LAST, ORDER };

static const kmp_past_signal *past_of(const kmp_present_inputs *inputs, int input)
{
    int k = input - kmp_model_given_inputs(inputs->model);
    return inputs->past && k >= 0 ? &inputs->past->signal[k] : NULL;
}

static void extend_piece(const kmp_past_signal *signal, kmp_signal_piece *piece)
{
    piece->c[LAST] = kmp_past_last(signal, piece->c[LAST]);
    piece->until = kmp_past_piece_of(signal, piece->c[LAST])->to + signal->delay;
}

static bool has_ended(const kmp_signal_piece *piece, double t)
{
    return piece->until <= t || kmp_same_time(piece->until, t);
}

static bool is_due(const kmp_past_signal *signal, const kmp_signal_piece *piece, double t)
{
    return has_ended(piece, t) && kmp_past_has(signal, piece->c[LAST] + 1);
}

void kmp_present_inputs_recall(kmp_present_inputs *inputs, const kmp_past *past)
{
    inputs->past = past;
    for (int k = 0; k < inputs->count; k++) {
        const kmp_past_signal *signal = past_of(inputs, k);
        if (!signal)
            continue;
        double first = signal->dropped;
        inputs->piece[k] =
            (kmp_signal_piece){.from = -INFINITY, .c = {first, first, KMP_PAST_SMOOTH}, .jump = KMP_SIGNAL_SMOOTH};
        extend_piece(signal, &inputs->piece[k]);
    }
}

void kmp_present_inputs_renew(kmp_present_inputs *inputs)
{
    for (int k = 0; k < inputs->count; k++)
        if (past_of(inputs, k))
            extend_piece(past_of(inputs, k), &inputs->piece[k]);
}

bool kmp_present_inputs_are_due(const kmp_present_inputs *inputs, double t)
{
    bool due = false;
    for (int k = 0; k < inputs->count && !inputs->waiting; k++)
        due = due || (past_of(inputs, k) ? is_due(past_of(inputs, k), &inputs->piece[k], t)
                                         : !inputs->replaced[k] && has_ended(&inputs->piece[k], t));
    return due || inputs->waiting;
}

int kmp_present_inputs_past_jump(const kmp_present_inputs *inputs, int input, double t)
{
    const kmp_signal_piece *piece = &inputs->piece[input];
    return past_of(inputs, input) && kmp_same_time(piece->from, t) ? (int)piece->c[ORDER] : KMP_PAST_SMOOTH;
}

void kmp_present_inputs_delayed(const kmp_present_inputs *inputs, int input, double t, double u[4])
{
    const kmp_signal_piece *piece = &inputs->piece[input];
    kmp_past_values(past_of(inputs, input), piece->c[FIRST], piece->c[LAST], t, u);
}

void kmp_present_inputs_source(const kmp_present_inputs *inputs, int input, double *from, double *to)
{
    const kmp_signal_piece *piece = &inputs->piece[input];
    *from = kmp_past_piece_of(past_of(inputs, input), piece->c[FIRST])->from;
    *to = kmp_past_piece_of(past_of(inputs, input), piece->c[LAST])->to;
}

/* -- pieces ------------------------------------------------------------------------------------------ */

static void follow_samples(const kmp_present_inputs *inputs, int k, double t)
{
    const kmp_signal_piece *piece = &inputs->piece[k];
    const kmp_signal *signal = &inputs->model->inputs[k].signal;
    bool before = inputs->before && t > 0;
    bool at_end = kmp_same_time(t, piece->until), at_start = kmp_same_time(t, piece->from);
    bool inside =
        before ? t > piece->from && !at_start && (t < piece->until || at_end) : t >= piece->from && t < piece->until;
    if (inputs->replaced[k] || inside)
        return;
    inputs->piece[k] = kmp_signal_at(signal, t);
    if (before && kmp_same_time(inputs->piece[k].from, t))
        inputs->piece[k] = kmp_signal_before(signal, inputs->piece[k].from);
}

const double *kmp_present_inputs_at(const kmp_present_inputs *inputs, double t)
{
    inputs->vector[0] = t;
    for (int k = 0; k < inputs->count; k++) {
        const kmp_past_signal *signal = past_of(inputs, k);
        if (signal) {
            /* The rate u + T u' of the state of the delay, and two derivatives. */
            const kmp_signal_piece *piece = &inputs->piece[k];
            double *values = inputs->vector + kmp_time_index(k, 0);
            double u[4];
            kmp_past_values(signal, piece->c[FIRST], piece->c[LAST], t, u);
            for (int i = 0; i < 3; i++)
                values[i] = u[i] + signal->delay * u[i + 1];
            continue;
        }
        if (!inputs->held)
            follow_samples(inputs, k, t);
        kmp_signal_values(&inputs->piece[k], t, inputs->vector + kmp_time_index(k, 0));
    }
    return inputs->vector;
}

void kmp_present_inputs_lanes(const kmp_present_inputs *inputs, int width, const double *t, double *vectors)
{
    if (inputs->count == 0) {
        memcpy(vectors, t, (size_t)width * sizeof *t);
        return;
    }
    for (int lane = 0; lane < width; lane++) {
        const double *vector = kmp_present_inputs_at(inputs, t[lane]);
        for (int k = 0; k < kmp_present_inputs_size(inputs); k++)
            vectors[k * width + lane] = vector[k];
    }
}

void kmp_present_inputs_give(kmp_present_inputs *inputs, int input, double from, const double values[3])
{
    double now[3];
    int order = 0; /* of the first derivative that differs from the present piece */
    kmp_signal_values(&inputs->piece[input], from, now);
    while (order < 3 && now[order] == values[order])
        order++;
    inputs->given[input] = (kmp_signal_piece){
        .from = from, .until = INFINITY, .c = {values[0], values[1], 0.5 * values[2], 0}, .jump = order};
    inputs->waits[input] = inputs->waiting = true;
}

void kmp_present_inputs_copy(kmp_present_inputs *to, const kmp_present_inputs *from)
{
    to->past = from->past;
    to->waiting = from->waiting;
    for (int k = 0; k < to->count; k++) {
        to->piece[k] = from->piece[k];
        to->given[k] = from->given[k];
        to->replaced[k] = from->replaced[k];
        to->waits[k] = from->waits[k];
    }
}

void kmp_present_inputs_forget(kmp_present_inputs *inputs)
{
    for (int k = 0; k < inputs->count; k++)
        if (past_of(inputs, k))
            inputs->piece[k] = kmp_signal_at(&inputs->model->inputs[k].signal, 0);
    inputs->past = NULL;
    kmp_present_inputs_take_samples(inputs);
}

void kmp_present_inputs_take_samples(kmp_present_inputs *inputs)
{
    for (int k = 0; k < inputs->count; k++) {
        if (inputs->replaced[k]) /* it would be taken for a piece of samples */
            inputs->piece[k] = kmp_signal_at(&inputs->model->inputs[k].signal, 0);
        inputs->replaced[k] = false;
    }
}

double kmp_present_inputs_until(const kmp_present_inputs *inputs)
{
    double until = INFINITY;
    for (int k = 0; k < inputs->count; k++) {
        double end = inputs->piece[k].until;
        until = kmp_same_time(until, end) ? fmax(until, end) : fmin(until, end);
    }
    return until;
}

int kmp_present_inputs_enter(kmp_present_inputs *inputs, double t, int *input)
{
    int least = KMP_SIGNAL_SMOOTH;
    inputs->waiting = false;
    for (int k = 0; k < inputs->count; k++) {
        const kmp_past_signal *signal = past_of(inputs, k);
        const kmp_signal *samples = &inputs->model->inputs[k].signal;
        if (signal ? !is_due(signal, &inputs->piece[k], t)
                   : !inputs->waits[k] && (inputs->replaced[k] || !has_ended(&inputs->piece[k], t)))
            continue;
        if (signal) {
            /* The part that begins at t, or before where several have ended. */
            kmp_signal_piece *piece = &inputs->piece[k];
            double first = piece->c[LAST] + 1, from = kmp_past_piece_of(signal, first)->from + signal->delay;
            int order = kmp_past_piece_of(signal, first)->jump;
            *piece = (kmp_signal_piece){.from = from < t && !kmp_same_time(from, t) ? from : t,
                                        .c = {first, first, order},
                                        .jump = order > 0 ? order - 1 : 0};
            extend_piece(signal, piece);
        } else {
            inputs->piece[k] =
                inputs->waits[k] ? inputs->given[k] : kmp_signal_at(samples, fmax(t, inputs->piece[k].until));
            inputs->replaced[k] = inputs->replaced[k] || inputs->waits[k];
            inputs->waits[k] = false;
        }
        if (inputs->piece[k].jump < least) {
            least = inputs->piece[k].jump;
            *input = k;
        }
    }
    return least;
}

void kmp_present_inputs_stand(kmp_present_inputs *inputs, double t)
{
    for (int k = 0; k < inputs->count; k++)
        if (!inputs->replaced[k] && !past_of(inputs, k))
            inputs->piece[k] = kmp_signal_at(&inputs->model->inputs[k].signal, t);
}
