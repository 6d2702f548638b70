/* SPDX-License-Identifier: BSD-3-Clause */
/* Builds the system with inputs and outputs: a variant for parameters among the inputs, outputs for force points, then
 * the linear equations at the requested state. The state is checked for equilibrium. */
#include "analyses/linearize/channels.h"
#include "analyses/derivatives/sampled_motion.h"
#include "analyses/derivatives/switching_state.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "dynamics/motion.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include "model/read/requests.h"
#include "platform/platform.h"
#include "studies/simulate/observed.h"
#include <kempe/extend.h>
#include <math.h>
#include <string.h>

/* -- construction ------------------------------------------------------------------------------------ */

/* The number of loads of an input: the function of a drive, and an input that moves a closure, act with their rates,
 * an input that a damper moves with its first one, all others directly. */
static int orders_of(const kempe_system *system, const kmp_requested_input *input)
{
    if (input->kind != KMP_REQUESTED_INPUT)
        return input->kind == KMP_REQUESTED_DRIVE ? 3 : 1;
    return kmp_model_moved_by(system->model, input->index) ? 3 : 1 + kmp_system_input_order(system, input->index);
}

/* Makes room. `linear` has chosen its u. `place`: for each input, the index of its point's position among the outputs
 * (only forces), or of its first derivative (only parameters and inputs of the model). KEMPE_E_MEMORY. */
static kempe_status transfer_init(kmp_transfer *t, kmp_linear *linear, kmp_slopes *slopes,
                                  const kmp_requested_inputs *inputs, const int *place, int outputs,
                                  const kmp_output_source *source)
{
    ptrdiff_t n = linear->n, m = linear->m, p = linear->p, columns = 0;
    for (int i = 0; i < inputs->count; i++)
        columns += orders_of(linear->system, &inputs->input[i]);
    *t = (kmp_transfer){.linear = linear,
                        .slopes = slopes,
                        .n = linear->n,
                        .m = linear->m,
                        .p = linear->p,
                        .inputs = inputs,
                        .outputs = outputs,
                        .columns = (int)columns};
    t->source = KMP_ARENA_NEW(&t->arena, kmp_output_source, outputs);
    t->load = KMP_ARENA_NEW(&t->arena, kmp_load, columns);
    KMP_TRY(
        kmp_made(linear->system->context,
                 KMP_ARENA_MAKE(&t->arena, KMP_ROOM(double, n *p, &t->map, &t->map_rate),
                                KMP_ROOM(double, p *columns, &t->loads),
                                KMP_ROOM(double, outputs *p, &t->by_u, &t->by_ud, &t->by_udd),
                                KMP_ROOM(double, outputs *columns, &t->direct), KMP_ROOM(double, outputs, &t->value),
                                KMP_ROOM(double, 3 * m + n, &t->side), KMP_ROOM(double, 3 * n + m, &t->moved),
                                KMP_ROOM(double, p, &t->unit), KMP_ROOM(double, slopes->shown, &t->shown))));
    memcpy(t->source, source, (size_t)outputs * sizeof *source);
    int at = 0;
    for (int i = 0; i < t->inputs->count; i++) {
        const kmp_requested_input *input = &t->inputs->input[i];
        for (int order = 0; order < orders_of(t->linear->system, input); order++)
            t->load[at++] =
                (kmp_load){.input = i,
                           .order = order,
                           .parameter = (input->kind == KMP_REQUESTED_PARAMETER || input->kind == KMP_REQUESTED_INPUT)
                                            ? place[i] + order
                                            : -1,
                           .place = input->kind == KMP_REQUESTED_FORCE ? place[i] : -1};
    }
    return KEMPE_OK;
}

KMP_CLEARS(kmp_transfer, transfer, kmp_arena_free(&transfer->arena))

/* -- at a state -------------------------------------------------------------------------------------- */

static void see(const kmp_transfer *t, const double *q, const double *qd, const double *qdd, const double *lambda,
                const double *shown, double *out)
{
    const double *in[] = {q, qd, qdd, lambda, shown};
    for (int k = 0; k < t->outputs; k++)
        out[k] = in[t->source[k].in][t->source[k].index];
}

/* The response to a change, including parameter k (-1: none): dR, and the outputs into out. */
static void follow(kmp_transfer *t, const kmp_change *change, int k, double *residual, double *out)
{
    double *q = t->moved, *qd = q + t->n, *qdd = qd + t->n, *lambda = qdd + t->n;
    kmp_linear_follow(t->linear, change, &(kmp_response){q, qd, qdd, lambda, residual});
    kmp_slopes_along(t->slopes, &t->slopes->outputs, &(kmp_direction){NULL, q, qd, qdd, lambda, NULL}, k, t->shown);
    see(t, q, qd, qdd, lambda, t->shown, out);
}

static void follow_load(kmp_transfer *t, const kmp_load *load, double *residual, double *out)
{
    int m = t->m;
    const kmp_requested_input *input = &t->inputs->input[load->input];
    double *h = t->side, *force = h + 3 * m;
    memset(h, 0, (size_t)(3 * m + t->n) * sizeof *h);
    switch (input->kind) {
    case KMP_REQUESTED_EFFORT:
        force[input->index] = -1;
        break;
    case KMP_REQUESTED_FORCE: /* to R: d(position of the point)/dq along the axis, negative */
        memset(t->shown, 0, (size_t)t->slopes->shown * sizeof *t->shown);
        t->shown[load->place + input->axis] = -1;
        kmp_slopes_gradient(t->slopes, &t->slopes->outputs, t->shown, &(kmp_direction){.q = force});
        break;
    case KMP_REQUESTED_DRIVE: /* h = q - f(t), f with a little more */
        for (int r = 0; r < m; r++)
            if (t->linear->system->rows[r].closure == input->index)
                h[load->order * m + r] = -1;
        break;
    case KMP_REQUESTED_INPUT:
    case KMP_REQUESTED_PARAMETER:
        (void)kmp_slopes_change(t->slopes, load->parameter, h);
        break;
    }
    follow(t, &(kmp_change){.h = h, .rate = h + m, .curve = h + 2 * m, .force = force}, load->parameter, residual, out);
}

/* A held state y follows a parameter of its start value at once: from its row g y + l w = 0 into the other rows. */
static void follow_held(const kmp_transfer *t, double *load, double *direct)
{
    const kmp_linear *l = t->linear;
    const int p = t->p;
    for (int k = 0; k < p; k++) {
        const kmp_state *state = kmp_state_of(l->system->model, l->part.u[k]);
        if (!state || !state->held || load[k] == 0)
            continue;
        const double y = -load[k] / l->damping[k + k * p];
        load[k] = 0;
        for (int i = 0; i < p; i++)
            load[i] += i == k ? 0 : l->damping[i + k * p] * y;
        for (int i = 0; i < t->outputs; i++)
            direct[i] += t->by_ud[i + k * t->outputs] * y;
    }
}

/* Evaluates all at the state of the linear equations, which must have Mr, Gr and Kr. No allocation. */
static void transfer_eval(kmp_transfer *t)
{
    int n = t->n, p = t->p, outputs = t->outputs;
    double *unit = t->unit;
    const kmp_linear *l = t->linear;
    kmp_instant at = kmp_linear_instant(l);
    kmp_slopes_at(t->slopes, &at);
    see(t, l->q, l->qd, l->qdd, l->lambda, kmp_slopes_values(&t->slopes->outputs, &at), t->value);
    for (int k = 0; k < p; k++) {
        unit[k] = 1;
        follow(t, &(kmp_change){.u = unit}, -1, t->linear->stiffness + k * p, t->by_u + k * outputs);
        memcpy(t->map + k * n, t->moved, (size_t)n * sizeof *unit);
        memcpy(t->map_rate + k * n, t->moved + n, (size_t)n * sizeof *unit);
        follow(t, &(kmp_change){.ud = unit}, -1, t->linear->damping + k * p, t->by_ud + k * outputs);
        follow(t, &(kmp_change){.udd = unit}, -1, t->linear->mass + k * p, t->by_udd + k * outputs);
        unit[k] = 0;
    }
    kmp_linear_inertia(t->linear);
    for (int k = 0; k < t->columns; k++) {
        follow_load(t, &t->load[k], t->loads + k * p, t->direct + k * outputs);
        follow_held(t, t->loads + k * p, t->direct + k * outputs);
    }
}

bool kmp_transfer_moves_closures(const kmp_transfer *transfer, int input)
{
    const kmp_slope_matrix *x = &transfer->slopes->equations;
    for (int c = 0; c < transfer->columns; c++) {
        const kmp_load *load = &transfer->load[c];
        if (load->input != input || transfer->inputs->input[input].kind != KMP_REQUESTED_PARAMETER)
            continue;
        for (int e = x->start[load->parameter]; e < x->start[load->parameter + 1]; e++)
            if (x->entry[e].row < transfer->m)
                return true;
    }
    return false;
}

/* -- first order ------------------------------------------------------------------------------------- */

/* to (rows x count) += left (rows x p) right (p x count, leading dimension ld). */
static void add_product(int rows, int p, int count, const double *left, const double *right, int ld, double *to)
{
    for (int j = 0; j < count; j++)
        for (int k = 0; k < p; k++)
            for (int i = 0; i < rows; i++)
                to[i + j * rows] += left[i + k * rows] * right[k + j * ld];
}

/* LU of Mr, where N' M N is positive. */
static int factor_mass(const kmp_linear *l, double *factor, int *pivot)
{
    size_t size = (size_t)l->p * (size_t)l->p * sizeof *factor;
    int failed = kmp_cholesky_factor(l->p, memcpy(factor, l->inertia ? l->inertia : l->mass, size));
    return failed ? failed : kmp_lu_factor(l->p, memcpy(factor, l->mass, size), pivot) ? -2 : 0;
}

/* The lower half of a column: -Mr^-1 of the column of a p x count matrix. */
static void put_accelerations(int p, const double *factor, const int *pivot, int count, const double *from, double *to)
{
    for (int j = 0; j < count; j++) {
        double *column = to + j * 2 * p + p;
        for (int i = 0; i < p; i++)
            column[i] = -from[i + j * p];
        kmp_lu_solve(p, factor, pivot, 1, column);
    }
}

/* Number k of u is one of the entries of x in the half of positions, or in the half of rates and values of states. */
static bool is_in(const kmp_linear *l, int k, int half)
{
    const kmp_state *state = kmp_state_of(l->system->model, l->part.u[k]);
    return !state || (half == 1 && !state->held);
}

int kmp_transfer_width(const kmp_transfer *transfer)
{
    int width = 0;
    for (int k = 0; k < 2 * transfer->p; k++)
        width += is_in(transfer->linear, k % transfer->p, k / transfer->p);
    return width;
}

int kmp_transfer_state(const kmp_transfer *transfer, int k)
{
    const int p = transfer->p;
    int from = 0;
    while (!is_in(transfer->linear, from % p, from / p) || k-- > 0)
        from++;
    return from;
}

int kmp_transfer_first_order(const kmp_transfer *t, double *a, double *b, double *c, double *d)
{
    size_t p = (size_t)t->p, outputs = (size_t)t->outputs, columns = (size_t)t->columns;
    const int width = kmp_transfer_width(t);
    double *mass = KMP_NEW(double, p *p);
    int *pivot = KMP_NEW(int, p), *place = KMP_NEW(int, width);
    int failed = mass && pivot && place ? factor_mass(t->linear, mass, pivot) : -1;
    if (failed == 0) {
        memset(a, 0, 4 * p * p * sizeof *a);
        memset(b, 0, 2 * p * columns * sizeof *b);
        for (size_t k = 0; k < p; k++)
            a[k + (p + k) * 2 * p] = 1;
        put_accelerations(t->p, mass, pivot, t->p, t->linear->stiffness, a);
        put_accelerations(t->p, mass, pivot, t->p, t->linear->damping, a + 2 * p * p);
        put_accelerations(t->p, mass, pivot, t->columns, t->loads, b);
        memcpy(c, t->by_u, outputs * p * sizeof *c);
        memcpy(c + outputs * p, t->by_ud, outputs * p * sizeof *c);
        memcpy(d, t->direct, outputs * columns * sizeof *d);
        add_product(t->outputs, t->p, 2 * t->p, t->by_udd, a + p, 2 * t->p, c);
        add_product(t->outputs, t->p, t->columns, t->by_udd, b + p, 2 * t->p, d);
        for (int k = 0; k < width; k++)
            place[k] = kmp_transfer_state(t, k);
        kmp_linear_squeeze(2 * t->p, width, place, width, place, a, a);
        kmp_linear_squeeze(2 * t->p, width, place, t->columns, NULL, b, b);
        kmp_linear_squeeze(t->outputs, t->outputs, NULL, width, place, c, c);
    }
    kmp_free(mass);
    kmp_free(pivot);
    kmp_free(place);
    return failed;
}

int kmp_transfer_sample(const kmp_transfer *t, double *a, double *b, double *period)
{
    const kmp_linear *l = t->linear;
    int width = kmp_transfer_width(t);
    double *every = KMP_NEW(double, width);
    for (int i = 0; every && i < width; i++) {
        int place = kmp_transfer_state(t, i) - t->p;
        const kmp_state *state = place >= 0 ? kmp_state_of(l->system->model, l->part.u[place]) : NULL;
        every[i] = state && kmp_state_is_sampled(state) ? state->period : INFINITY;
    }
    int failed = every ? kmp_sampled_map(width, t->columns, a, b, every, period, a, b) : -1;
    kmp_free(every);
    return failed;
}

/* A state counts as an equilibrium when the residual R is this small relative to the forces: far above rounding, far
 * below a visible motion. */
static const double at_rest = 1e-8;

/* -- names ------------------------------------------------------------------------------------------- */

static bool names_init(kmp_channels *c, kmp_names *names, int count)
{
    *names = (kmp_names){count, KMP_ARENA_NEW(&c->arena, char *, count), KMP_ARENA_NEW(&c->arena, char *, count)};
    return !c->arena.failed;
}

static bool name_states(kmp_channels *c)
{
    static const char *const turns[] = {"rad", "rad/s"}, *const slides[] = {"m", "m/s"};
    int p = c->linear.p, width = kmp_transfer_width(&c->transfer);
    bool ok = names_init(c, &c->states, width);
    for (int i = 0; ok && i < width; i++) {
        int k = kmp_transfer_state(&c->transfer, i), coordinate = c->linear.part.u[k % p];
        const kmp_motion *motion = &c->system->model->motions[coordinate];
        bool state = kmp_state_of(c->system->model, coordinate);
        kmp_text name = {0};
        kmp_text_printf(&name, "%s.%s", state ? "state" : k < p ? "q" : "qd", motion->name);
        const char *unit = state ? "" : (motion->rotation ? turns : slides)[k / p];
        c->states.name[i] = kmp_text_keep(&name, &c->arena);
        c->states.unit[i] = kmp_arena_strdup(&c->arena, unit);
    }
    return !c->arena.failed;
}

/* In SI. */
static char *unit_of_input(kmp_arena *arena, const kmp_model_input *input, int order)
{
    kmp_text unit = {0};
    kmp_dimension dimension = input->dimension;
    for (int k = 0; k < order; k++)
        dimension = kmp_dimension_times(dimension, KMP_DIM_TIME, -1);
    kmp_dimension_put_unit(&unit, dimension);
    return kmp_text_keep(&unit, arena);
}

static char *unit_of_load(kmp_arena *arena, const kempe_model *model, const kmp_requested_input *input, int order)
{
    static const char *const turns[] = {"rad", "rad/s", "rad/s^2"}, *const slides[] = {"m", "m/s", "m/s^2"};
    switch (input->kind) {
    case KMP_REQUESTED_EFFORT:
        return kmp_arena_strdup(arena, model->motions[input->index].rotation ? "N m" : "N");
    case KMP_REQUESTED_FORCE:
        return kmp_arena_strdup(arena, "N");
    case KMP_REQUESTED_DRIVE:
        return kmp_arena_strdup(
            arena, (model->motions[model->closures[input->index].motion].rotation ? turns : slides)[order]);
    case KMP_REQUESTED_INPUT:
        return unit_of_input(arena, &model->inputs[input->index], order);
    case KMP_REQUESTED_PARAMETER:
        break;
    }
    return kmp_arena_strdup(arena, "");
}

/* In the arena; NULL: no memory. */
static char *name_of_load(kmp_channels *c, const kmp_requested_input *input, int order)
{
    return kmp_arena_printf(&c->arena, "%s%s", input->name, kmp_derivative_ends[order]);
}

static bool name_loads(kmp_channels *c)
{
    const kmp_transfer *t = &c->transfer;
    bool ok = names_init(c, &c->loads, t->columns);
    for (int k = 0; ok && k < t->columns; k++) {
        const kmp_requested_input *input = &c->inputs.input[t->load[k].input];
        c->loads.name[k] = name_of_load(c, input, t->load[k].order);
        c->loads.unit[k] = unit_of_load(&c->arena, c->system->model, input, t->load[k].order);
    }
    return !c->arena.failed;
}

/* -- outputs ----------------------------------------------------------------------------------------- */

/* The columns of a run's table that the outputs select; NULL parts: all. */
static kempe_status take_columns(kmp_channels *c, const unsigned *parts, bool none, kmp_output_source **source)
{
    kmp_columns columns;
    KMP_TRY(kmp_made(c->system->context, kmp_columns_init(&columns, c->system, c->system->model, parts)));
    int count = none ? 0 : columns.count - 1; /* without time */
    *source = KMP_ARENA_NEW(&c->arena, kmp_output_source, count);
    bool ok = names_init(c, &c->outputs, count);
    for (int k = 0; ok && k < count; k++) {
        const kmp_column *of = &columns.of[k + 1];
        (*source)[k] = (kmp_output_source){(kmp_output_kind_of_source)of->quantity, of->index};
        c->outputs.name[k] = kmp_arena_strdup(&c->arena, columns.name[k + 1]);
        c->outputs.unit[k] = kmp_arena_strdup(&c->arena, columns.unit[k + 1]);
    }
    kmp_columns_free(&columns);
    return c->arena.failed ? kmp_fail_memory(c->system->context) : KEMPE_OK;
}

/* Makes room for one more output of a copy, the position of a point, without requested components; its number, -1: no
 * memory. */
static int add_position(kempe_model *copy, int point, unsigned **parts)
{
    int count = copy->output_count;
    kmp_output *outputs = KMP_ARENA_NEW(&copy->arena, kmp_output, count + 1);
    unsigned *bits = KMP_ARENA_NEW(&copy->arena, unsigned, count + 1);
    if (!outputs || !bits)
        return -1;
    for (int k = 0; k < count; k++) {
        outputs[k] = copy->outputs[k];
        bits[k] = *parts ? (*parts)[k] : ~0u;
    }
    outputs[count] = (kmp_output){.kind = KMP_OUTPUT_POSITION, .index = point};
    copy->outputs = outputs;
    *parts = bits;
    return copy->output_count++;
}

/* -- the system -------------------------------------------------------------------------------------- */

static kempe_status make_system(kmp_channels *c, const kmp_channels_options *options, int count,
                                const char *const *names, unsigned **parts, int *place)
{
    const kempe_system *given = c->given;
    KMP_TRY(kmp_variant_new(given->model, count, names, &c->variant));
    /* The outputs of the copy: the requested ones, and the positions of points with input forces. */
    kempe_model *copy = kmp_variant_model(c->variant);
    if (options->outputs)
        KMP_TRY(kmp_requested_outputs(copy, options->outputs, parts));
    for (int k = 0; k < c->inputs.count; k++) {
        if (c->inputs.input[k].kind != KMP_REQUESTED_FORCE)
            continue;
        int output = add_position(copy, c->inputs.input[k].index, parts);
        KMP_TRY(kmp_made(copy->context, output >= 0));
        place[k] = 0;
        for (int o = 0; o < output; o++)
            place[k] += kmp_output_width(copy, &copy->outputs[o]);
    }
    KMP_TRY(kmp_system_of_variant(c->variant, &c->own));
    kempe_system_set_force(c->own, given->force, given->force_user);
    c->system = c->own;
    return KEMPE_OK;
}

/* -- the state --------------------------------------------------------------------------------------- */

/* Checks that forces are constant while the independent coordinates move at the rates of the start. */
static kempe_status judge_steady(kmp_channels *c, bool *steady)
{
    kmp_linear *l = &c->linear;
    kmp_steady *rates = KMP_ARENA_NEW(&c->arena, kmp_steady, l->p);
    kmp_search search = {.rates = rates};
    KMP_TRY(kmp_made(c->system->context, rates));
    for (int k = 0; k < l->p; k++)
        if (!kmp_state_of(l->system->model, l->part.u[k]))
            rates[search.rate_count++] =
                (kmp_steady){.coordinate = l->part.u[k], .rate = c->at->inner_qd[l->part.u[k]]};
    KMP_TRY(kmp_linear_at_rates(l, c->at->t, c->at->inner_q, c->at->inner_qd, false));
    kmp_linear_matrices(l);
    c->residual = kmp_equilibrium_residual(l);
    *steady = c->residual <= at_rest;
    kempe_status status = *steady ? kmp_operating_check(l, &search) : KEMPE_OK;
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(c->system->context); /* balanced only for an instant */
    *steady = false;
    return KEMPE_OK;
}

/* Checks that the state is at rest or in steady motion: no acceleration, and no force that changes. */
static kempe_status judge_rest(kmp_channels *c, const int *wish, int wish_count)
{
    kmp_linear *l = &c->linear;
    l->plain = !c->at->equilibrium; /* another state is linear below */
    kempe_status status = kmp_operating_take(c->at, l, wish, wish_count);
    l->plain = false;
    KMP_TRY(status);
    if (c->at->equilibrium) {
        c->rests = true;
        c->residual = c->at->residual;
    } else {
        KMP_TRY(judge_steady(c, &c->rests));
        KMP_TRY(kmp_operating_take(c->at, l, wish, wish_count));
    }
    for (int k = 0; k < kmp_model_coordinates(l->system->model); k++)
        c->goes_on = c->goes_on || (c->rests && l->qd[k] != 0);
    return KEMPE_OK;
}

/* -- the whole --------------------------------------------------------------------------------------- */

/* The names of what derivatives are taken by: parameters of a variant. `place` of each. Their count. */
static int list_parameters(const kmp_channels *c, const char **names, int *place)
{
    int count = 0;
    for (int k = 0; k < c->inputs.count; k++)
        if (c->inputs.input[k].kind == KMP_REQUESTED_PARAMETER) {
            place[k] = count;
            names[count++] = c->inputs.input[k].name;
        }
    return count;
}

/* Continues the list with the numbers of inputs that the system reads. */
static int list_inputs(kmp_channels *c, int count, const char **names, int *place)
{
    for (int k = 0; k < c->inputs.count; k++) {
        const kmp_requested_input *input = &c->inputs.input[k];
        if (input->kind != KMP_REQUESTED_INPUT)
            continue;
        place[k] = count;
        for (int order = 0; order < orders_of(c->system, input); order++)
            names[count++] = name_of_load(c, input, order);
    }
    return count;
}

static kempe_status build(kmp_channels *c, const kmp_channels_options *options)
{
    const kmp_backend *backend = kmp_backend_choose(c->system->context, options->backend);
    unsigned *parts = NULL;
    kmp_output_source *source = NULL;
    if (!backend)
        return KEMPE_E_ARGUMENT;
    KMP_TRY(options->inputs ? kmp_requested_inputs_read(c->system->model, options->inputs, &c->inputs) : KEMPE_OK);
    bool none = !options->outputs && c->inputs.count == 0;
    const char **names = KMP_ARENA_NEW(&c->arena, const char *, KMP_TIME_NUMBERS * c->inputs.count);
    int *place = KMP_ARENA_NEW(&c->arena, int, c->inputs.count); /* of each input, for transfer_init */
    KMP_TRY(kmp_made(c->system->context, !c->arena.failed));
    const int parameters = list_parameters(c, names, place);
    bool forces = false; /* act at points, whose positions are outputs */
    for (int k = 0; k < c->inputs.count; k++)
        forces = forces || c->inputs.input[k].kind == KMP_REQUESTED_FORCE;
    if (parameters > 0 || options->outputs || forces)
        KMP_TRY(make_system(c, options, parameters, names, &parts, place));
    KMP_TRY(kmp_motion_need(c->system));
    const int count = list_inputs(c, parameters, names, place);
    KMP_TRY(kmp_made(c->system->context, !c->arena.failed));
    KMP_TRY(take_columns(c, parts, none, &source));
    /* The state, in whose charts and coordinates the equations are linear. */
    int *wish = KMP_ARENA_NEW(&c->arena, int, c->system->n), wish_count = 0;
    KMP_TRY(kmp_made(c->system->context, wish));
    KMP_TRY(kmp_coordinates_read(c->system->model, "independent", options->independent, wish, &wish_count));
    KMP_TRY(kmp_linear_init(&c->linear, c->system, backend->name));
    KMP_TRY(kmp_operating_new(c->system, options->at, &c->linear, &c->at));
    c->at->slides = options->slides;
    kempe_status status = judge_rest(c, wish, wish_count);
    if (status == KEMPE_E_FAILED && !*kempe_context_message(c->system->context))
        return kmp_fail(c->system->context, status,
                        "%s: at this state the independent coordinates have no accelerations: the closures or the "
                        "reduced mass are singular; 'kempe check' gives details",
                        c->system->model->name);
    KMP_TRY(status);
    kmp_linear_doubt_state(&c->linear, true);
    KMP_TRY(kmp_averaged_judge(c->averaged, &c->linear));
    KMP_TRY(kmp_linear_settle_switches(&c->linear, true, true));
    KMP_TRY(kmp_slopes_new(c->system, backend->name, count, names, forces || c->outputs.count > 0, &c->slopes));
    KMP_TRY(transfer_init(&c->transfer, &c->linear, c->slopes, &c->inputs, place, c->outputs.count, source));
    KMP_TRY(kmp_made(c->system->context, name_states(c) && name_loads(c)));
    transfer_eval(&c->transfer);
    return KEMPE_OK;
}

kempe_status kmp_channels_init(kmp_channels *channels, const kempe_system *system, const kmp_channels_options *options)
{
    double begin = kmp_cpu_now();
    *channels = (kmp_channels){0};
    kempe_status status = kmp_averaged_new(system, &channels->averaged);
    channels->given = channels->system = kmp_averaged_system(channels->averaged, system);
    if (status == KEMPE_OK)
        status = build(channels, options);
    channels->build_s = system->build_s + (kmp_cpu_now() - begin);
    if (status != KEMPE_OK)
        kmp_channels_free(channels);
    return status;
}

KMP_CLEARS(kmp_channels, c, kmp_free(c->warnings), kmp_transfer_free(&c->transfer), kmp_slopes_free(c->slopes),
           kmp_linear_free(&c->linear), kmp_operating_free(c->at), kempe_system_free(c->own),
           kmp_variant_free(c->variant), kmp_averaged_free(c->averaged), kmp_requested_inputs_free(&c->inputs),
           kmp_arena_free(&c->arena))
