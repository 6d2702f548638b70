/* SPDX-License-Identifier: BSD-3-Clause */
/* Delays. One by samples is a chain of sampled states. A continuous one is a state that follows the past of its input
 * u: with the delay T its rate is
 *
 *     y' = (w(t) - y)/T,     w(t) = u(t - T) + T u'(t - T),
 *
 * whose solution y(t) = u(t - T) is attracting. A run gives w, an input of the model without a name for users, by the
 * recorded past (integrators/run/delays.h). The term 0 u makes conditions and kinks of u those of the equations, so
 * that they are located. */
#include "model/read/read_delays.h"
#include "model/data/model.h"
#include "model/language/limits.h"
#include "model/read/function_block.h"
#include "model/read/read_states.h"
#include "model/read/read_values.h"
#include <math.h>

enum { MOST_DELAYS = 1000 };

/* The input of the rate of a continuous delay. Outside of runs it is zero. */
static void add_signal(kmp_reader *r, kmp_function_block *b)
{
    static const double start = 0;
    kempe_model *model = r->model;
    kmp_model_input *inputs = kmp_arena_room(&model->arena, model->inputs, model->input_count, sizeof *inputs);
    const char *name = kmp_arena_printf(&model->arena, "%s.signal", b->name);
    if (!inputs || !name)
        return;
    model->inputs = inputs;
    b->signal = model->input_count;
    kmp_model_input *input = &inputs[model->input_count++];
    *input =
        (kmp_model_input){.name = name, .place = b->place, .unit = "", .si = 1, .used = true, .dimension = KMP_DIM_ANY};
    (void)kmp_signal_init(&input->signal, &model->arena, KMP_SIGNAL_HOLD, 1, &start, &input->value);
    model->delay_count++;
}

static int count_delay(kmp_reader *r, kmp_function_block *b)
{
    double time = 0, sample = 0;
    const kmp_yaml *node = kmp_read_required(r, b->map, b->what, "time");
    const kmp_yaml *period = kmp_yaml_get(b->map, "sample"), *before = kmp_yaml_get(b->map, "before");
    if (!period)
        add_signal(r, b);
    if (before && (period || kmp_yaml_get(b->map, "start")))
        kmp_reader_complain(r, before->place, "%s: 'before' cannot stand beside '%s'", b->what,
                            period ? "sample" : "start");
    if (!node || !period || !kmp_read_fixed(r, node, kmp_reader_say(r, "time of %s", b->what), KMP_DIM_TIME, &time) ||
        !kmp_read_fixed(r, period, kmp_reader_say(r, "sample of %s", b->what), KMP_DIM_TIME, &sample))
        return 1;
    double samples = time / sample, whole = round(samples);
    bool good = samples >= 0 && whole <= MOST_DELAYS && fabs(samples - whole) <= KMP_WHOLE_SAMPLES * whole;
    if (!good)
        kmp_reader_complain(r, node->place,
                            "time of %s is %.9g samples: a whole number of them, %d at most, is expected", b->what,
                            samples, MOST_DELAYS);
    return good ? (int)whole + 1 : 1;
}

/* a + 0 u, with u itself, whose node may be a condition. */
static const kmp_expr *add_none_of(kmp_reader *r, const kmp_expr *a, const kmp_expr *u)
{
    static const kmp_expr zero = {.kind = KMP_EXPR_NUMBER};
    kmp_expr *none = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1), *sum = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    if (!none || !sum)
        return NULL;
    *none = (kmp_expr){.kind = KMP_EXPR_MUL, .a = &zero, .b = u};
    *sum = (kmp_expr){.kind = KMP_EXPR_ADD, .a = a, .b = none};
    return sum;
}

static void read_continuous(kmp_reader *r, kmp_function_block *b)
{
    const kmp_yaml *node = kmp_yaml_get(b->map, "time"), *before = kmp_yaml_get(b->map, "before");
    kmp_state *state = &r->model->states[b->first];
    const char *of = kmp_reader_say(r, "time of %s", b->what);
    const kmp_expr *u = kmp_block_input(r, b);
    if (!node || !kmp_read_number(r, node, of, KMP_DIM_TIME, &state->delay) ||
        !kmp_check_rule(r, node, of, KMP_FIELD_POSITIVE, state->delay.value, ""))
        return;
    if (before)
        state->before = kmp_read_expr(r, before, kmp_reader_say(r, "before of %s", b->what), KMP_DIM_ANY, KMP_OF_TIME);
    kmp_expr_locals locals = {0};
    kmp_expr *w = KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1);
    if (!w)
        return;
    state->signal = b->signal;
    state->delayed = u;
    state->began = kmp_yaml_get(b->map, "start");
    *w = (kmp_expr){.kind = KMP_EXPR_INPUT, .index = state->signal, .unit = KMP_DIM_ANY};
    kmp_block_local(&locals, "w", w);
    kmp_block_local(&locals, "y", kmp_block_state(r, b, 0));
    kmp_block_local(&locals, "time", kmp_block_number(r, &state->delay));
    const kmp_expr *follows = u ? kmp_block_formula(r, "(w - y)/time", &locals) : NULL;
    b->rate[0] = follows ? add_none_of(r, follows, u) : NULL;
}

static void read_delay(kmp_reader *r, kmp_function_block *b)
{
    if (!b->sampled) {
        read_continuous(r, b);
        return;
    }
    const kmp_expr *u = kmp_block_input(r, b);
    for (int i = 0; i < b->count; i++) {
        r->model->states[b->first + i].start = r->model->states[b->first].start;
        kmp_block_law(r, b, i, i < b->count - 1 ? kmp_block_state(r, b, i + 1) : u);
    }
}

const kmp_block_kind kmp_block_delay = {"delay", " time sample before ", count_delay, NULL, read_delay};
