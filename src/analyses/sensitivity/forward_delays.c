/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of delayed signals y(t) = u(t - T). With
 *
 *     U(t) = du/dp - u' dT/dp,    dy/dp (t) = U(t - T),
 *
 * the past of U is recorded like the past of u (integrators/run/delays.h), from the dense output of the whole step. The
 * equation of dy/dp is (U + T U' - dy/dp)/T, whose solution U(t - T) attracts, and the derivative is set to it at
 * restarts. If u jumps at a time t_e(p), y jumps at t_e + T, and so do the derivatives of all that it moves:
 * dt/dp = dt_e/dp + dT/dp. */
#include "analyses/sensitivity/forward_delays.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "model/data/parameter.h"
#include "model/data/start.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

/* A jump of a signal that is less than this part of its size is one of rounding. */
#define NO_JUMP 1e-12

/* A signal jumps at t, with dt/dp. */
typedef struct signal_jump {
    struct signal_jump *before;
    double t;
    int signal;
    double swing[];
} signal_jump;

struct kmp_forward_delays {
    int count, parameters;
    int *state;     /* of each delay: its place among the states */
    double *delay;  /* T */
    double *by;     /* count x parameters: dT/dp */
    kmp_past *past; /* signal k by parameter p: number k parameters + p */
    double *room;
    double *row, *rate, *value; /* 3 count: derivatives of all rows, by p and by t; u */
    double *now;                /* count x parameters: U */
    double *last;               /* u at the end of the past */
    signal_jump *jump;          /* the last one */
    double t, *swing;           /* of the last restart: its time, and dt/dp there */
    bool mixed;                 /* it had several */
    double *swing_now;          /* dt/dp of the jumps now */
    kmp_runner *runner;         /* whose step is recorded */
    bool begins;                /* no value of this record has been taken */
};

static const kmp_state *state_of(const kmp_forward_formulation *f, int k)
{
    return kmp_model_state(f->system->model, f->delays->state[k]);
}

/* The coordinate whose rate is the state of a delay. */
static int motion_of(const kmp_forward_formulation *f, int k)
{
    return kmp_model_coordinates(f->system->model) + f->delays->state[k];
}

/* The place of delay k among the unknowns. */
static int place_of(const kmp_forward_formulation *f, int k)
{
    return f->zone.now ? motion_of(f, k) : kmp_linear_place(&f->v->linear, motion_of(f, k));
}

static const kmp_present_inputs *inputs_of(const kmp_forward_formulation *f)
{
    return &kmp_forward_eval(f)->inputs;
}

/* -- construction ------------------------------------------------------------------------------------ */

bool kmp_forward_delays_make(kmp_forward_formulation *f)
{
    const kempe_model *model = f->system->model;
    const int count = kmp_model_delay_count(model), all = count * f->count;
    if (count == 0 || f->count == 0)
        return true;
    kmp_forward_delays *x = f->delays = KMP_ARENA_NEW(&f->arena, kmp_forward_delays, 1);
    if (!x || !KMP_ARENA_MAKE(&f->arena, KMP_ROOM(int, count, &x->state), KMP_ROOM(double, count, &x->delay, &x->last),
                              KMP_ROOM(double, 3 * count, &x->row, &x->rate, &x->value),
                              KMP_ROOM(double, all, &x->by, &x->now), KMP_ROOM(double, kmp_past_room(all), &x->room),
                              KMP_ROOM(double, f->count, &x->swing, &x->swing_now)))
        return false;
    x->parameters = f->count;
    x->t = NAN;
    for (int k = 0; k < kmp_model_state_count(model); k++)
        if (kmp_model_state(model, k)->delayed)
            x->state[x->count++] = k;
    x->past = kmp_past_new(all);
    return x->past;
}

void kmp_forward_delays_free(kmp_forward_formulation *f)
{
    while (f->delays && f->delays->jump) {
        signal_jump *before = f->delays->jump->before;
        kmp_free(f->delays->jump);
        f->delays->jump = before;
    }
    if (f->delays)
        kmp_past_free(f->delays->past);
}

/* -- recording --------------------------------------------------------------------------------------- */

static kempe_status add_jump(kmp_forward_formulation *f, int signal)
{
    kmp_forward_delays *x = f->delays;
    const size_t bytes = (size_t)x->parameters * sizeof(double);
    if (x->t == x->past->known && x->mixed) {
        kmp_text_printf(&f->formulation.reason,
                        "the input of '%s' jumps at t = %.9g where several events meet: the motion has no derivative "
                        "with respect to parameters after the delay",
                        state_of(f, signal)->name, x->past->known);
        return KEMPE_E_FAILED;
    }
    signal_jump *jump = kmp_calloc(1, sizeof *jump + bytes);
    KMP_TRY(kmp_made(f->system->context, jump));
    jump->before = x->jump;
    jump->t = x->past->known;
    jump->signal = signal;
    for (int p = 0; p < x->parameters; p++)
        jump->swing[p] = x->t == jump->t ? x->swing[p] : 0;
    x->jump = jump;
    return KEMPE_OK;
}

/* U of all signals by all parameters from u', du/dp and dT/dp of rows `first` on. */
static void take_by(kmp_forward_formulation *f, int first, int p)
{
    kmp_forward_delays *x = f->delays;
    for (int k = 0; k < x->count; k++)
        x->now[k * x->parameters + p] = x->row[first + k] - x->rate[first + k] * x->by[k * x->parameters + p];
}

static kempe_status sample(void *user, double t, const double **values)
{
    kmp_forward_formulation *f = user;
    kmp_forward_delays *x = f->delays;
    kmp_sensitivity_equations *v = f->v;
    kmp_linear *l = &v->linear;
    kmp_slope_matrix *of = &v->slopes->delayed;
    double one = 1;
    const double *y = kmp_runner_unknowns(x->runner, t);
    if (!y || kmp_forward_stand_at(f, t, y, true) != KMP_GO)
        return KEMPE_E_FAILED;
    const kmp_instant at = kmp_linear_instant(l);
    memcpy(x->value, kmp_slopes_values(of, &at), (size_t)x->count * sizeof *x->value);
    if (x->begins) {
        /* The first values after the end of the past, next to the values before it. */
        for (int k = 0; k < x->count; k++) {
            double size = fmax(fmax(fabs(x->value[k]), fabs(x->last[k])), state_of(f, k)->scale);
            if (fabs(x->value[k] - x->last[k]) > NO_JUMP * size)
                KMP_TRY(add_jump(f, k));
        }
    }
    x->begins = false;
    kmp_slopes_along(v->slopes, of, &(kmp_direction){.t = &one, .q = l->qd, .qd = l->qdd}, -1, x->rate);
    for (int p = 0; p < x->parameters; p++) {
        kmp_forward_follow(f, y, p, f->place.dq, f->place.dqd, NULL, NULL);
        kmp_slopes_along(v->slopes, of, &(kmp_direction){.q = f->place.dq, .qd = f->place.dqd}, p, x->row);
        take_by(f, 0, p);
    }
    *values = x->now;
    return KEMPE_OK;
}

static double tolerance(void *user, int signal, double size)
{
    const kmp_forward_formulation *f = user;
    const int k = signal / f->delays->parameters, p = signal % f->delays->parameters;
    const double least = f->start.atol * state_of(f, k)->scale / f->sizes[p];
    return KMP_PAST_PART * (f->options->spec->rtol * size + least) + KMP_PAST_ROUNDING * size;
}

bool kmp_forward_delays_record(kmp_forward_formulation *f, kmp_runner *runner, double to)
{
    kmp_forward_delays *x = f->delays;
    if (!x || !(to > x->past->known))
        return true;
    const kmp_past_source source = {x->past, 0, x->past->count - 1, x->room, f, sample, tolerance};
    x->runner = runner;
    x->begins = true;
    int fast;
    if (kmp_past_record(&source, x->past->known, to, &fast) != KEMPE_OK)
        return false;
    memcpy(x->last, x->value, (size_t)x->count * sizeof *x->last);
    x->past->known = to;
    /* Forgets what no later step needs. */
    signal_jump **jump = &x->jump;
    double longest = 0;
    for (int k = 0; k < x->count; k++)
        longest = fmax(longest, x->delay[k]);
    const double since = x->past->known - 2 * longest;
    for (int i = 0; i < x->past->count; i++) {
        kmp_past_signal *signal = &x->past->signal[i];
        double first = signal->dropped;
        while (first + 1 < signal->dropped + signal->count && kmp_past_piece_of(signal, first)->to < since)
            first++;
        if (2 * (first - signal->dropped) >= signal->count)
            kmp_past_drop(signal, first);
    }
    while (*jump && (*jump)->t >= since)
        jump = &(*jump)->before;
    while (*jump) {
        signal_jump *gone = *jump;
        *jump = gone->before;
        kmp_free(gone);
    }
    return true;
}

/* -- the start --------------------------------------------------------------------------------------- */

static kmp_instant instant_at(const kmp_forward_formulation *f, double t)
{
    const kmp_linear *l = &f->v->linear;
    return kmp_instant_of(l->eval, t, f->place.q, f->place.qd, l->qdd, l->lambda);
}

static kempe_status sample_before(void *user, double t, const double **values)
{
    kmp_forward_formulation *f = user;
    kmp_forward_delays *x = f->delays;
    kmp_sensitivity_equations *v = f->v;
    double one = 1;
    const kmp_instant at = instant_at(f, t);
    (void)kmp_slopes_values(&v->slopes->delayed, &at);
    kmp_slopes_along(v->slopes, &v->slopes->delayed, &(kmp_direction){.t = &one}, -1, x->rate);
    for (int p = 0; p < x->parameters; p++) {
        kmp_slopes_along(v->slopes, &v->slopes->delayed, &(kmp_direction){0}, p, x->row);
        take_by(f, x->count, p);
    }
    *values = x->now;
    return KEMPE_OK;
}

/* Derivatives of the states of delays at the start. One that begins with its own input may contain others; another one
 * begins with the start value of its state, by the model or as a parameter. */
static void begin_states(kmp_forward_formulation *f, double t)
{
    kmp_forward_delays *x = f->delays;
    kmp_slope_matrix *of = &f->v->slopes->delayed;
    for (int pass = 0; pass < x->count; pass++) {
        const kmp_instant at = instant_at(f, t);
        (void)kmp_slopes_values(of, &at);
        for (int p = 0; p < x->parameters; p++) {
            double *dqd = f->place.dqd + p * f->n;
            kmp_slopes_along(f->v->slopes, of, &(kmp_direction){.q = f->place.dq + p * f->n, .qd = dqd}, p, x->row);
            for (int k = 0; k < x->count; k++) {
                const kmp_state *state = state_of(f, k);
                const int motion = motion_of(f, k);
                bool given = state->began || kmp_model_start(f->system->model)->qd[motion].expr != state->start.expr;
                dqd[motion] = state->before || given ? dqd[motion] : x->row[k];
            }
        }
    }
}

/* dT/dp, and the past of signals with an expression of it. */
static kempe_status begin_given(kmp_forward_formulation *f, int k, double t)
{
    kmp_forward_delays *x = f->delays;
    const double *value;
    const int all = x->parameters;
    const kmp_past_source source = {x->past, k * all, (k + 1) * all - 1, x->room, f, sample_before, tolerance};
    int fast;
    KMP_TRY(kmp_past_record(&source, t - x->delay[k], t, &fast));
    KMP_TRY(sample_before(f, t - x->delay[k], &value));
    for (int p = 0; p < all; p++)
        f->place.dqd[p * f->n + motion_of(f, k)] = value[k * all + p];
    return KEMPE_OK;
}

static kempe_status begin_constant(kmp_forward_formulation *f, int k, double t)
{
    kmp_forward_delays *x = f->delays;
    double constant[KMP_PAST_DEGREE + 1];
    for (int p = 0; p < x->parameters; p++) {
        for (int i = 0; i <= KMP_PAST_DEGREE; i++)
            constant[i] = f->place.dqd[p * f->n + motion_of(f, k)];
        if (!kmp_past_add(&x->past->signal[k * x->parameters + p], t - x->delay[k], t, constant))
            return KEMPE_E_MEMORY;
    }
    return KEMPE_OK;
}

kempe_status kmp_forward_delays_begin(kmp_forward_formulation *f, double t)
{
    kmp_forward_delays *x = f->delays;
    if (!x)
        return KEMPE_OK;
    kempe_status status = KEMPE_OK;
    kmp_slope_matrix *of = &f->v->slopes->delayed;
    const kmp_past *past = inputs_of(f)->past;
    const kmp_instant at = instant_at(f, t);
    memcpy(x->value, kmp_slopes_values(of, &at), (size_t)(2 * x->count) * sizeof *x->value);
    for (int p = 0; p < x->parameters; p++) {
        kmp_slopes_along(f->v->slopes, of, &(kmp_direction){0}, p, x->row);
        for (int k = 0; k < x->count; k++)
            x->by[k * x->parameters + p] = x->row[2 * x->count + k];
    }
    for (int k = 0; k < x->count; k++) {
        x->delay[k] = past->signal[k].delay;
        x->last[k] = state_of(f, k)->before ? x->value[x->count + k] : f->place.qd[motion_of(f, k)];
        for (int p = 0; p < x->parameters; p++)
            x->past->signal[k * x->parameters + p].delay = x->delay[k];
    }
    for (int k = 0; status == KEMPE_OK && k < x->count; k++)
        status = state_of(f, k)->before ? begin_given(f, k, t) : KEMPE_OK;
    begin_states(f, t);
    for (int k = 0; status == KEMPE_OK && k < x->count; k++)
        status = state_of(f, k)->before ? KEMPE_OK : begin_constant(f, k, t);
    x->past->known = t;
    return status == KEMPE_E_MEMORY ? kmp_fail_memory(f->system->context) : status;
}

/* -- values ------------------------------------------------------------------------------------------ */

/* The numbers of the first and the last piece that lie between two times, which are ends of pieces. */
static void pieces_between(const kmp_past_signal *signal, double from, double to, double *first, double *last)
{
    int low = 0, high = signal->count - 1;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (signal->piece[middle].from >= from)
            high = middle;
        else
            low = middle + 1;
    }
    *first = signal->dropped + low;
    for (high = signal->count - 1; low < high;) {
        int middle = high - (high - low) / 2;
        if (signal->piece[middle].to <= to)
            low = middle;
        else
            high = middle - 1;
    }
    *last = signal->dropped + low;
}

/* U and U' of delay k by parameter p at t - T. */
static void recall(const kmp_forward_formulation *f, int k, int p, double t, double values[4])
{
    const kmp_forward_delays *x = f->delays;
    const kmp_past_signal *signal = &x->past->signal[k * x->parameters + p];
    double from, to, first, last;
    kmp_present_inputs_source(inputs_of(f), state_of(f, k)->signal, &from, &to);
    pieces_between(signal, from, to, &first, &last);
    kmp_past_values(signal, first, last, t, values);
}

void kmp_forward_delays_rates(const kmp_forward_formulation *f, const double *y, int p, double *sudd)
{
    const kmp_forward_delays *x = f->delays;
    double values[4];
    for (int k = 0; x && k < x->count; k++) {
        const int i = place_of(f, k);
        recall(f, k, p, f->v->linear.t, values);
        sudd[i] = values[1] + (values[0] - y[kmp_forward_blocks(f) + (p + 1) * f->width + i]) / x->delay[k];
    }
}

void kmp_forward_delays_set(kmp_forward_formulation *f, double t, double *y)
{
    const kmp_forward_delays *x = f->delays;
    double values[4];
    for (int k = 0; x && k < x->count; k++)
        for (int p = 0; p < x->parameters; p++) {
            recall(f, k, p, t, values);
            y[kmp_forward_blocks(f) + (p + 1) * f->width + place_of(f, k)] = values[0];
        }
}

/* -- jumps ------------------------------------------------------------------------------------------- */

void kmp_forward_delays_note(kmp_forward_formulation *f, double t, const double *swing)
{
    kmp_forward_delays *x = f->delays;
    if (!x)
        return;
    const bool more = x->t == t;
    x->mixed = more && (x->mixed || !kmp_same_swing(x->parameters, x->swing, swing));
    x->t = t;
    memcpy(x->swing, swing, (size_t)x->parameters * sizeof *swing);
}

int kmp_forward_delays_jump(kmp_forward_formulation *f, double t, const double **swing)
{
    kmp_forward_delays *x = f->delays;
    double from, to;
    *swing = NULL;
    for (int k = 0; x && k < x->count; k++) {
        const int input = state_of(f, k)->signal;
        if (kmp_present_inputs_past_jump(inputs_of(f), input, t) >= KMP_PAST_SMOOTH)
            continue;
        kmp_present_inputs_source(inputs_of(f), input, &from, &to);
        const signal_jump *jump = x->jump;
        while (jump && (jump->signal != k || jump->t != from))
            jump = jump->before;
        if (!jump)
            continue;
        for (int p = 0; p < x->parameters; p++)
            x->now[p] = jump->swing[p] + x->by[k * x->parameters + p];
        if (*swing && !kmp_same_swing(x->parameters, x->swing_now, x->now)) {
            kmp_text_printf(&f->formulation.reason,
                            "'%s' jumps at t = %.9g s together with another delayed signal, and the two times depend "
                            "on parameters differently: the motion has no derivative there",
                            state_of(f, k)->name, t);
            return KMP_HALT;
        }
        memcpy(x->swing_now, x->now, (size_t)x->parameters * sizeof *x->now);
        *swing = x->swing_now;
    }
    return KMP_GO;
}

void kmp_forward_delays_pass(kmp_forward_formulation *f, double t, const double *qd)
{
    const kmp_forward_delays *x = f->delays;
    double values[4], u[4];
    for (int k = 0; x && k < x->count; k++) {
        const int motion = motion_of(f, k);
        kmp_present_inputs_delayed(inputs_of(f), state_of(f, k)->signal, t, u);
        f->place.qd[motion] = qd[motion];
        for (int p = 0; p < x->parameters; p++) {
            recall(f, k, p, t, values);
            f->place.dqd[p * f->n + motion] = values[0] + u[1] * f->times.swing[p];
        }
    }
}
