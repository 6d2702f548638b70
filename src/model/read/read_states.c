/* SPDX-License-Identifier: BSD-3-Clause */
/* States and function blocks: their names and motions before any expression is read that may contain them; the laws of
 * states after all that those may contain, the value of a block that is an expression where it is first used. */
#include "model/read/read_states.h"
#include "model/data/model.h"
#include "model/language/expression.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include "model/language/limits.h"
#include "model/read/read_algebraic.h"
#include "model/read/read_bodies.h"
#include "model/read/read_compliant.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "model/read/reader.h"
#include <math.h>
#include <string.h>

static const kmp_key keys[] = {
#include "model/keys/state_keys.def"
    {0}};

/* A kind of entry: a row of `kinds`. */
typedef struct kmp_function_block block;

typedef struct block_kind {
    const char *key;                                  /* the key that only it has */
    const char *keys;                                 /* the others, in addition to `start` and `scale` */
    int (*count)(kmp_reader *r, block *b);            /* its states; sets b->direct */
    const char *(*suffix)(const block *b, int state); /* of the name of a state that is not its value */
    void (*read)(kmp_reader *r, block *b);            /* sets rates and next values, and the value if it is direct */
    bool at_once;                                     /* its input depends on no multipliers */
} block_kind;

struct kmp_function_block {
    const kmp_yaml *map;
    const char *name, *what;
    kmp_place place;
    const block_kind *kind; /* NULL after an error */
    int first, count;       /* its states */
    bool direct; /* its value is an expression of the model, `output` among them; otherwise its first state */
    int output;
    bool sampled;
    int signal;            /* of a continuous delay: the input of its rate */
    const kmp_expr **rate; /* of its states */
    enum { KMP_BLOCK_WAITS, KMP_BLOCK_BEGUN, KMP_BLOCK_READ } progress;
};

enum { MOST_NESTED_BLOCKS = 50 }; /* reading them recurses */

/* -- formulas of blocks ------------------------------------------------------------------------------ */

static const kmp_expr *make(kmp_reader *r, kmp_expr expr)
{
    return kmp_expr_make(&r->model->arena, expr);
}

static const kmp_expr *zero(kmp_reader *r)
{
    return make(r, (kmp_expr){.kind = KMP_EXPR_NUMBER});
}

/* The value of state i of a block. */
static const kmp_expr *block_state(kmp_reader *r, const block *b, int i)
{
    return make(r, (kmp_expr){.kind = KMP_EXPR_QD, .index = kmp_model_coordinates(r->model) + b->first + i});
}

/* An expression by a text with names of locals; NULL: no memory, or a local that is used is missing. */
static const kmp_expr *block_formula(kmp_reader *r, const char *text, const kmp_expr_locals *locals)
{
    return !r->scratch.failed && !r->model->arena.failed ? kmp_expr_formula(&r->model->arena, text, locals) : NULL;
}

static const char *of_key(kmp_reader *r, const block *b, const char *key)
{
    return kmp_reader_say(r, "%s of %s", key, b->what);
}

static bool has(const block *b, const char *key)
{
    return kmp_yaml_get(b->map, key);
}

/* A number as an expression. */
static const kmp_expr *block_number(kmp_reader *r, const kmp_number *x)
{
    return x->expr ? x->expr : make(r, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = x->value});
}

/* Reads the number of a key; NULL when it is absent or wrong. `*value`: its value, if there is one. */
static const kmp_expr *block_key(kmp_reader *r, const block *b, const char *key, double *value)
{
    kmp_number number;
    const kmp_yaml *node = kmp_yaml_get(b->map, key);
    if (!node || !kmp_read_number(r, node, of_key(r, b, key), kmp_key_dimension(keys, key), &number))
        return NULL;
    if (value)
        *value = number.value;
    return block_number(r, &number);
}

/* A list of two numbers; false when absent or wrong. */
static bool block_two(kmp_reader *r, const block *b, const char *key, kmp_number two[2])
{
    const kmp_yaml *list = kmp_yaml_get(b->map, key);
    const char *of = of_key(r, b, key);
    if (!list || !kmp_read_list(r, list, of, 2))
        return false;
    bool good = kmp_read_number(r, list->items[0], of, KMP_DIM_ANY, &two[0]);
    return kmp_read_number(r, list->items[1], of, KMP_DIM_ANY, &two[1]) && good;
}

/* The input of a block, under the key of its kind; NULL after an error. It contains no multipliers where `direct`. */
static const kmp_expr *block_input(kmp_reader *r, const block *b)
{
    const char *key = b->kind->key, *of = kmp_reader_say(r, "%s of %s", key, b->what);
    bool at_once = b->direct || b->sampled || b->kind->at_once;
    const kmp_yaml *node = kmp_yaml_get(b->map, key);
    const kmp_expr *u = kmp_read_expr(r, node, of, KMP_DIM_ANY, at_once ? KMP_OF_STATE : KMP_OF_LOADS);
    if (at_once && kmp_expr_lambda(u))
        kmp_reader_complain(r, node->place, "%s depends on multipliers, which is not allowed here", of);
    return u;
}

/* Gives state i its law: the next value of a sampled block, or its rate. */
static void block_law(kmp_reader *r, block *b, int i, const kmp_expr *law)
{
    if (b->sampled)
        r->model->states[b->first + i].next = law;
    b->rate[i] = b->sampled ? zero(r) : law;
}

/* Gives a direct block its value. */
static void block_value(kmp_reader *r, const block *b, const kmp_expr *value)
{
    kmp_reader_take_named(r, b->map->place, b->what, value, &r->model->unknowns[b->output]);
}

/* -- controllers ------------------------------------------------------------------------------------- */

/* Controllers with proportional, integral and derivative parts (Astrom and Hagglund 1995, chapter 3): v = Kp e + i + Kd
 * d, u = v between its limits, i' = Ki e + (u - v)/Tt, where d is the derivative of e through a lag of Tf, (e - f)/Tf
 * with f' = d. A sampled one has the integral by forward and the derivative by backward differences. */

/* Its states: the held output of a sampled one, the integral, the filtered input. */
static int integral_of(const block *b)
{
    return b->sampled;
}

static int filtered_of(const block *b)
{
    return b->sampled + has(b, "integral");
}

static int count_pid(kmp_reader *r, block *b)
{
    int own = has(b, "integral") + has(b, "filter");
    b->direct = !b->sampled;
    if (own == 0 && !b->sampled)
        kmp_complain_of(r, b->map, b->what,
                        "a controller has an integral, or a derivative with a filter; write it as an expression");
    return b->sampled + own > 0 ? b->sampled + own : 1;
}

static const char *suffix_of_pid(const block *b, int state)
{
    return has(b, "integral") && state == integral_of(b) ? "integral" : "filtered";
}

static bool check_pid(kmp_reader *r, const block *b)
{
    if (has(b, "derivative") && has(b, "filter") == has(b, "slope"))
        return kmp_complain_of(r, b->map, b->what,
                               "a derivative has the time 'filter', or the rate of the input as 'slope'");
    if (b->sampled && has(b, "start") && !has(b, "integral"))
        return kmp_complain_of(r, kmp_yaml_get(b->map, "start"), b->what,
                               "'start' is where the integral begins, and this controller has none: leave it out");
    if (!has(b, "derivative") && (has(b, "filter") || has(b, "slope")))
        return kmp_complain_of(r, b->map, b->what, "'filter' and 'slope' belong to a derivative");
    if (has(b, "limits") && has(b, "integral") && !has(b, "tracking") && !has(b, "proportional"))
        return kmp_complain_of(r, b->map, b->what,
                               "limits of a controller with only an integral need the time 'tracking'");
    return true;
}

/* A positive time, as a local. */
static void read_time(kmp_reader *r, const block *b, const char *key, kmp_expr_locals *locals)
{
    double value = 1;
    const kmp_yaml *node = kmp_yaml_get(b->map, key);
    kmp_local_put(locals, key, block_key(r, b, key, &value));
    if (node)
        (void)kmp_check_rule(r, node, of_key(r, b, key), KMP_FIELD_POSITIVE, value, "");
}

/* The sum of its parts. */
static const kmp_expr *sum_of(kmp_reader *r, const block *b, const kmp_expr_locals *locals)
{
    const char *derivative = has(b, "slope")     ? " + kd*slope"
                             : !has(b, "filter") ? ""
                             : b->sampled        ? " + kd*(e - f)/(filter + T)"
                                                 : " + kd*(e - f)/filter";
    return block_formula(r,
                         kmp_reader_say(r, "%s%s%s", has(b, "proportional") ? "kp*e" : "0",
                                        has(b, "integral") ? " + i" : "", derivative),
                         locals);
}

/* The rate of the integral. Without a time the difference of both sums is taken back within the geometric mean of the
 * integral's and the derivative's times, or the integral's time. */
static const kmp_expr *integral_law(kmp_reader *r, const block *b, const kmp_expr_locals *locals)
{
    const char *back = !has(b, "limits")      ? ""
                       : has(b, "tracking")   ? " + (u - v)/tracking"
                       : has(b, "derivative") ? " + (u - v)/sqrt(kd/ki)"
                                              : " + (u - v)/(kp/ki)";
    return block_formula(r, kmp_reader_say(r, b->sampled ? "i + T*(ki*e%s)" : "ki*e%s", back), locals);
}

static void read_pid(kmp_reader *r, block *b)
{
    kmp_number limit[2];
    kmp_expr_locals locals = {0}, ends = {0};
    bool good = check_pid(r, b), limited = block_two(r, b, "limits", limit);
    kmp_local_put(&locals, "e", block_input(r, b));
    kmp_local_put(&locals, "kp", block_key(r, b, "proportional", NULL));
    kmp_local_put(&locals, "ki", block_key(r, b, "integral", NULL));
    kmp_local_put(&locals, "kd", block_key(r, b, "derivative", NULL));
    read_time(r, b, "filter", &locals);
    read_time(r, b, "tracking", &locals);
    if (has(b, "slope"))
        kmp_local_put(
            &locals, "slope",
            kmp_read_expr(r, kmp_yaml_get(b->map, "slope"), of_key(r, b, "slope"), KMP_DIM_ANY, KMP_OF_STATE));
    if (b->sampled)
        kmp_local_put(&locals, "T",
                      make(r, (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = r->model->states[b->first].period}));
    if (has(b, "integral"))
        kmp_local_put(&locals, "i", block_state(r, b, integral_of(b)));
    if (has(b, "filter"))
        kmp_local_put(&locals, "f", block_state(r, b, filtered_of(b)));
    if (!good || r->wrong)
        return;
    const kmp_expr *v = sum_of(r, b, &locals), *u = v;
    if (limited) {
        kmp_local_put(&ends, "v", v);
        kmp_local_put(&ends, "low", block_number(r, &limit[0]));
        kmp_local_put(&ends, "high", block_number(r, &limit[1]));
        u = block_formula(r, "min(high, max(low, v))", &ends);
        kmp_local_put(&locals, "v", v);
        kmp_local_put(&locals, "u", u);
    }
    if (b->direct)
        block_value(r, b, u);
    else
        block_law(r, b, 0, u);
    if (has(b, "integral")) {
        block_law(r, b, integral_of(b), integral_law(r, b, &locals));
        r->model->states[b->first + integral_of(b)].start = r->model->states[b->first].start;
    }
    if (has(b, "filter"))
        block_law(r, b, filtered_of(b),
                  block_formula(r, b->sampled ? "(filter*f + T*e)/(filter + T)" : "(e - f)/filter", &locals));
}

/* -- transfer functions ------------------------------------------------------------------------------ */

/* Transfer functions (b_0 s^n + b_1 s^(n-1) + .. + b_n) / (a_0 s^n + a_1 s^(n-1) + .. + a_n) u as states, in the
 * observable canonical form (Kailath 1980, section 2.1):
 *
 *     y = x_1 + b_0 u / a_0,     x_i' = x_(i+1) + (b_i u - a_i y) / a_0,     x_(n+1) = 0.
 *
 * Without b_0 the output is the first state. A sampled one is a function of z in place of s: x_i' is the next value
 * of x_i, and its output is held between samples in a separate state, before the others. */

static int length_of(const block *b, const char *key)
{
    const kmp_yaml *list = kmp_yaml_get(b->map, key);
    return list && list->kind == KMP_YAML_LIST ? list->count : 0;
}

static int count_states(kmp_reader *r, block *b)
{
    int poles = length_of(b, "denominator");
    (void)r;
    b->direct = !b->sampled && poles > 1 && length_of(b, "numerator") == poles;
    return b->sampled ? (poles > 1 ? poles : 1) : poles > 2 ? poles - 1 : 1;
}

/* The coefficients of a polynomial in falling powers; NULL after an error. */
static kmp_number *read_polynomial(kmp_reader *r, const block *b, const char *key, int *count)
{
    const kmp_yaml *list = kmp_read_required(r, b->map, b->what, key);
    const char *of = of_key(r, b, key);
    bool good = list && kmp_read_list(r, list, of, -1);
    *count = good ? list->count : 0;
    kmp_number *x = good ? KMP_ARENA_NEW(&r->scratch, kmp_number, *count) : NULL;
    for (int i = 0; x && i < *count; i++)
        good = kmp_read_number(r, list->items[i], of, KMP_DIM_ANY, &x[i]) && good;
    return good ? x : NULL;
}

/* Input, output and coefficients; of the i-th state its follower too. */
typedef struct filter {
    const kmp_expr *u, *y;
    kmp_number *a, *b;
    int order, zeros;
} filter;

/* The number b_i; NULL: it is zero. */
static const kmp_expr *zero_of(kmp_reader *r, const filter *f, int i)
{
    int at = i - (f->order + 1 - f->zeros);
    return at >= 0 ? block_number(r, &f->b[at]) : NULL;
}

static const kmp_expr *law_of(kmp_reader *r, const filter *f, int i, const kmp_expr *follower)
{
    kmp_expr_locals locals = {0};
    const kmp_expr *b = zero_of(r, f, i);
    kmp_local_put(&locals, "u", f->u);
    kmp_local_put(&locals, "y", f->y);
    kmp_local_put(&locals, "a", block_number(r, &f->a[i]));
    kmp_local_put(&locals, "lead", block_number(r, &f->a[0]));
    kmp_local_put(&locals, "b", b);
    kmp_local_put(&locals, "next", follower);
    return block_formula(r,
                         follower && b ? "next + (b*u - a*y)/lead"
                         : follower    ? "next + -(a*y)/lead"
                         : b           ? "(b*u - a*y)/lead"
                                       : "-(a*y)/lead",
                         &locals);
}

/* x_1, and what the input adds to it at once. */
static const kmp_expr *output_of(kmp_reader *r, const filter *f, const kmp_expr *first)
{
    kmp_expr_locals locals = {0};
    const kmp_expr *b = zero_of(r, f, 0);
    kmp_local_put(&locals, "u", f->u);
    kmp_local_put(&locals, "first", first);
    kmp_local_put(&locals, "lead", block_number(r, &f->a[0]));
    kmp_local_put(&locals, "b", b);
    return b ? block_formula(r, "first + b*u/lead", &locals) : first;
}

static void read_transfer(kmp_reader *r, block *b)
{
    int poles;
    filter f = {.u = block_input(r, b)};
    f.a = read_polynomial(r, b, "denominator", &poles);
    f.b = read_polynomial(r, b, "numerator", &f.zeros);
    f.order = poles - 1;
    if (!f.u || !f.a || !f.b)
        return;
    if (f.order < 1 || f.zeros > f.order + 1 || f.a[0].value == 0) {
        kmp_complain_of(r, b->map, b->what,
                        "the denominator of a transfer function has at least the degree of its numerator, and 1, with "
                        "a leading coefficient that is not zero");
        return;
    }
    int held = b->sampled; /* the state that holds the output comes before the others */
    f.y = output_of(r, &f, block_state(r, b, held));
    if (b->direct)
        block_value(r, b, f.y);
    if (held) {
        block_law(r, b, 0, f.y);
        r->model->states[b->first + held].start = r->model->states[b->first].start;
    }
    for (int i = 1; i <= f.order; i++) {
        block_law(r, b, held + i - 1, law_of(r, &f, i, i < f.order ? block_state(r, b, held + i) : NULL));
        if (!held) {
            double size = fabs(f.a[i].value / f.a[0].value);
            kmp_state *states = r->model->states + b->first;
            if (i < f.order)
                states[i].scale = states[0].scale * (size > 0 ? size : 1);
        }
    }
}

/* -- delays ------------------------------------------------------------------------------------------ */

/* Delays. One by samples is a chain of sampled states. A continuous one is a state that follows the past of its input
 * u: with the delay T its rate is
 *
 *     y' = (w(t) - y)/T,     w(t) = u(t - T) + T u'(t - T),
 *
 * whose solution y(t) = u(t - T) is attracting. A run gives w, an input of the model without a name for users, by the
 * recorded past (integrators/run/delays.h). The term 0 u makes conditions and kinks of u conditions and kinks of the
 * equations, so that they are located. */

enum { MOST_DELAYS = 1000 };

/* The input of the rate of a continuous delay. Outside of runs it is zero. */
static void add_signal(kmp_reader *r, block *b)
{
    static const double start = 0;
    kempe_model *model = r->model;
    const char *name = kmp_arena_printf(&model->arena, "%s.signal", b->name);
    if (!name || !KMP_ARENA_GROW(&model->arena, model->inputs, model->input_count))
        return;
    b->signal = model->input_count;
    kmp_model_input *input = &model->inputs[model->input_count++];
    *input =
        (kmp_model_input){.name = name, .place = b->place, .unit = "", .si = 1, .used = true, .dimension = KMP_DIM_ANY};
    (void)kmp_signal_init(&input->signal, &model->arena, KMP_SIGNAL_HOLD, 1, &start, &input->value);
    model->delay_count++;
}

static int count_delay(kmp_reader *r, block *b)
{
    double time = 0, sample = 0;
    const kmp_yaml *node = kmp_read_required(r, b->map, b->what, "time");
    const kmp_yaml *period = kmp_yaml_get(b->map, "sample"), *before = kmp_yaml_get(b->map, "before");
    if (!period)
        add_signal(r, b);
    if (before && (period || kmp_yaml_get(b->map, "start")))
        kmp_complain_of(r, before, b->what, "'before' and '%s' exclude each other", period ? "sample" : "start");
    if (!node || !period || !kmp_read_fixed(r, node, of_key(r, b, "time"), KMP_DIM_TIME, &time) ||
        !kmp_read_fixed(r, period, of_key(r, b, "sample"), KMP_DIM_TIME, &sample))
        return 1;
    double samples = time / sample, whole = round(samples);
    bool good = samples >= 0 && whole <= MOST_DELAYS && fabs(samples - whole) <= KMP_WHOLE_SAMPLES * whole;
    if (!good)
        kmp_reader_complain(r, node->place,
                            "time of %s is %.9g samples: a whole number of them, %d at most, is expected", b->what,
                            samples, MOST_DELAYS);
    return good ? (int)whole + 1 : 1;
}

static void read_continuous(kmp_reader *r, block *b)
{
    const kmp_yaml *node = kmp_yaml_get(b->map, "time"), *before = kmp_yaml_get(b->map, "before");
    kmp_state *state = &r->model->states[b->first];
    const kmp_expr *u = block_input(r, b);
    if (!node || !kmp_read_ruled(r, node, of_key(r, b, "time"), KMP_DIM_TIME, KMP_FIELD_POSITIVE, &state->delay))
        return;
    if (before)
        state->before = kmp_read_expr(r, before, of_key(r, b, "before"), KMP_DIM_ANY, KMP_OF_TIME);
    kmp_expr_locals locals = {0};
    const kmp_expr *w = make(r, (kmp_expr){.kind = KMP_EXPR_INPUT, .index = b->signal, .unit = KMP_DIM_ANY});
    if (!w)
        return;
    state->signal = b->signal;
    state->delayed = u;
    state->began = kmp_yaml_get(b->map, "start");
    kmp_local_put(&locals, "w", w);
    kmp_local_put(&locals, "y", block_state(r, b, 0));
    kmp_local_put(&locals, "time", block_number(r, &state->delay));
    const kmp_expr *follows = u ? block_formula(r, "(w - y)/time", &locals) : NULL;
    const kmp_expr *none = make(r, (kmp_expr){.kind = KMP_EXPR_MUL, .a = zero(r), .b = u}); /* u may be a condition */
    b->rate[0] = follows && none ? make(r, (kmp_expr){.kind = KMP_EXPR_ADD, .a = follows, .b = none}) : NULL;
}

static void read_delay(kmp_reader *r, block *b)
{
    if (!b->sampled) {
        read_continuous(r, b);
        return;
    }
    const kmp_expr *u = block_input(r, b);
    for (int i = 0; i < b->count; i++) {
        r->model->states[b->first + i].start = r->model->states[b->first].start;
        block_law(r, b, i, i < b->count - 1 ? block_state(r, b, i + 1) : u);
    }
}

/* -- states with a separate law ---------------------------------------------------------------------- */

static int one_state(kmp_reader *r, block *b)
{
    (void)r, (void)b;
    return 1;
}

static void read_rate(kmp_reader *r, block *b)
{
    b->rate[0] = kmp_read_expr(r, kmp_yaml_get(b->map, "rate"), of_key(r, b, "rate"), KMP_DIM_ANY, KMP_OF_LOADS);
}

static void read_next(kmp_reader *r, block *b)
{
    static const char *const times[] = {"sample", "when"};
    const kmp_yaml *node = kmp_yaml_get(b->map, "when");
    (void)kmp_read_one_key(r, b->map, b->what, KMP_NAMES_OF(times));
    b->rate[0] = zero(r);
    r->model->states[b->first].next =
        kmp_read_expr(r, kmp_yaml_get(b->map, "next"), of_key(r, b, "next"), KMP_DIM_ANY, KMP_OF_NEXT);
    if (!node)
        return;
    const kmp_expr *when = kmp_read_expr(r, node, of_key(r, b, "when"), KMP_DIM_ANY, KMP_COMPARISON);
    if (kmp_expr_lambda(when))
        kmp_reader_complain(r, node->place, "when of %s: changes of multipliers are not located", b->what);
    if (kmp_expr_acceleration(when))
        kmp_reader_complain(r, node->place, "when of %s: changes of accelerations are not located", b->what);
    /* The rate is zero in any case, so that the comparison is a condition of the equations, and its changes are
     * located.
     */
    b->rate[0] =
        when ? make(r,
                    (kmp_expr){
                        .kind = KMP_EXPR_CALL, .function = KMP_FUNCTION_if, .a = when, .b = zero(r), .c = zero(r)})
             : NULL;
}

/* Hysteresis changes where its input leaves the interval of its limits; which limit it is, decides its value. */
static void read_hysteresis(kmp_reader *r, block *b)
{
    kmp_number limit[2], value[2] = {{.value = 0}, {.value = 1}};
    kmp_expr_locals locals = {0};
    kmp_local_put(&locals, "x", block_input(r, b));
    bool good = kmp_read_required(r, b->map, b->what, "limits") && block_two(r, b, "limits", limit);
    if (!good || locals.count < 1 || (kmp_yaml_get(b->map, "values") && !block_two(r, b, "values", value)))
        return;
    if (limit[0].value >= limit[1].value)
        kmp_reader_complain(r, b->map->place, "limits of %s: the first one, %g, must be below the second one, %g",
                            b->what, limit[0].value, limit[1].value);
    kmp_local_put(&locals, "a", block_number(r, &limit[0]));
    kmp_local_put(&locals, "b", block_number(r, &limit[1]));
    kmp_local_put(&locals, "low", block_number(r, &value[0]));
    kmp_local_put(&locals, "high", block_number(r, &value[1]));
    kmp_state *state = &r->model->states[b->first];
    state->next = block_formula(r, "if(2*x > a + b, high, low)", &locals);
    const kmp_expr *out = block_formula(r, "if((x - a)*(x - b) > 0, 0, 0)", &locals);
    b->rate[0] = out;
    state->settles = true;
    if (!kmp_yaml_get(b->map, "start"))
        state->start = value[0];
}

static const block_kind kinds[] = {
    {"rate", "", one_state, NULL, read_rate, false},
    {"next", "sample when", one_state, NULL, read_next, false},
    {"transfer", "numerator denominator sample", count_states, NULL, read_transfer, false},
    {"pid", "proportional integral derivative filter slope limits tracking sample", count_pid, suffix_of_pid, read_pid,
     false},
    {"hysteresis", "limits values", one_state, NULL, read_hysteresis, false},
    {"delay", "time sample before", count_delay, NULL, read_delay, true}};

/* -- entries ----------------------------------------------------------------------------------------- */

static const char *name_of(kmp_reader *r, const block *b, int i)
{
    if (i == 0 && !b->direct)
        return b->name;
    if (b->kind && b->kind->suffix)
        return kmp_arena_printf(&r->model->arena, "%s.%s", b->name, b->kind->suffix(b, i));
    return kmp_arena_printf(&r->model->arena, "%s.%d", b->name, i + 1);
}

void kmp_reader_add_state(kmp_reader *r, const char *name, kmp_place place)
{
    kempe_model *model = r->model;
    if (!name || !KMP_ARENA_GROW(&model->arena, model->states, model->state_count))
        return;
    model->states[model->state_count++] = (kmp_state){.name = name, .place = place, .scale = 1, .period = INFINITY};
    (void)kmp_reader_add_motion(r, (kmp_motion){.name = name, .rotation = true, .axis = {1, 0, 0}});
}

/* The first state, or the first one of the block, begins at `start`. */
static void read_common(kmp_reader *r, const block *b)
{
    const kmp_yaml *start = kmp_yaml_get(b->map, "start"), *node = kmp_yaml_get(b->map, "scale"),
                   *sample = kmp_yaml_get(b->map, "sample");
    kmp_state *state = &r->model->states[b->first];
    if (start)
        (void)kmp_read_number(r, start, of_key(r, b, "start"), KMP_DIM_ANY, &state->start);
    double scale = state->start.value != 0 ? fabs(state->start.value) : 1, period = INFINITY;
    if (node)
        (void)kmp_read_fixed_ruled(r, node, of_key(r, b, "scale"), KMP_DIM_ANY, KMP_FIELD_POSITIVE, &scale);
    state->scale = scale > 0 ? scale : 1;
    if (sample)
        (void)kmp_read_fixed_ruled(r, sample, of_key(r, b, "sample"), KMP_DIM_TIME, KMP_FIELD_POSITIVE, &period);
    for (int i = 0; i < b->count; i++)
        r->model->states[b->first + i].period = period;
}

/* The kind of an entry; NULL after an error. */
static const block_kind *kind_of(kmp_reader *r, const block *b)
{
    int first = -1, count = kmp_count_keys(b->map, KMP_NAMES_OF(kinds), &first);
    bool discrete = has(b, "sample") || has(b, "when");
    if (count > 1)
        kmp_complain_keys(r, b->map->place, b->what, KMP_NAMES_OF(kinds), count);
    else if (count == 0)
        (void)kmp_read_required(r, b->map, b->what, discrete ? "next" : "rate");
    return count == 1 ? &kinds[first] : NULL;
}

static void add_block(kmp_reader *r, const kmp_section *s)
{
    block *b = &r->blocks[r->block_count++];
    *b = (block){.map = s->node, .name = s->name ? s->name : "", .what = s->what, .place = s->key->place, .output = -1};
    if (kmp_read_map(r, b->map, b->what, keys))
        b->kind = kind_of(r, b);
    for (int k = 0; b->kind && k < b->map->count; k++) {
        const char *key = b->map->keys[k]->text;
        bool own = strcmp(key, b->kind->key) == 0 || kmp_text_behind_word("start scale", key);
        if (!own && !kmp_text_behind_word(b->kind->keys, key))
            kmp_complain_of(r, b->map->keys[k], b->what, "'%s' is not a key of a state with '%s'", key, b->kind->key);
    }
    b->sampled = b->kind && kmp_yaml_get(b->map, "sample");
    b->count = b->kind ? b->kind->count(r, b) : 1;
    b->rate = KMP_ARENA_NEW(&r->scratch, const kmp_expr *, b->count);
    b->first = r->model->state_count;
    for (int i = 0; i < b->count && !r->model->arena.failed; i++)
        kmp_reader_add_state(r, name_of(r, b, i), b->place);
    if (b->direct) {
        /* The value of a block is a variable of the model, before the algebraic ones. */
        b->output = r->model->unknowns_count;
        r->model->unknowns[r->model->unknowns_count++] = (kmp_unknowns){.name = b->name, .block = true};
    }
    if (b->kind && !r->model->arena.failed && b->count > 0)
        read_common(r, b);
}

void kmp_read_states(kmp_reader *r)
{
    kempe_model *model = r->model;
    kmp_section s = kmp_read_section(r, "states", "state");
    const kmp_yaml *map = kmp_yaml_get(r->root, "algebraic");
    int algebraic = map && map->kind == KMP_YAML_MAP ? map->count : 0;
    model->unknowns = KMP_ARENA_NEW(&model->arena, kmp_unknowns, s.count + algebraic);
    r->blocks = KMP_ARENA_NEW(&r->scratch, block, s.count);
    while (model->unknowns && r->blocks && kmp_section_next(&s)) {
        kmp_place place = s.key->place;
        const char *name = s.name;
        if (kmp_name_means_something(r, name))
            kmp_reader_complain(r, place, "a state cannot have the name '%s', which is already defined", name);
        else if (kmp_name_find(KMP_COORDINATES(r->model), name) >= 0)
            kmp_reader_complain(r, place, "a state cannot have the name '%s', which a coordinate has", name);
        add_block(r, &s);
    }
    /* Elements may have states: each contact whose law depends on the rate at its beginning. These are the last states.
     */
    const kmp_yaml *contacts = kmp_yaml_get(r->root, "contacts");
    r->first_element_state = r->model->state_count;
    kmp_read_wings(r, KMP_READ_WITH_STATES);
    for (int k = 0; contacts && contacts->kind == KMP_YAML_MAP && k < contacts->count; k++)
        if (kmp_contact_keeps_rate(contacts->items[k]))
            kmp_reader_add_state(r, kmp_arena_printf(&r->model->arena, "%s.impact", contacts->keys[k]->text),
                                 contacts->keys[k]->place);
    r->first_algebraic = model->unknowns_count;
}

/* -- laws -------------------------------------------------------------------------------------------- */

/* The reader's scope is the scope of the expression that needs the block. */
static void read_block(kmp_reader *r, block *b)
{
    int scope = r->scope, line = r->scope_line;
    const kmp_expr_locals *locals = r->locals;
    r->locals = NULL;
    b->progress = KMP_BLOCK_BEGUN;
    r->block_level++;
    if (b->kind && b->rate && !r->model->arena.failed)
        b->kind->read(r, b);
    r->block_level--;
    b->progress = KMP_BLOCK_READ;
    r->scope = scope;
    r->scope_line = line;
    r->locals = locals;
}

void kmp_read_block_of(kmp_reader *r, int unknown)
{
    for (int k = 0; unknown < r->first_algebraic && k < r->block_count; k++) {
        block *b = &r->blocks[k];
        if (b->output != unknown || b->progress == KMP_BLOCK_READ)
            continue;
        if (b->progress == KMP_BLOCK_BEGUN)
            kmp_reader_complain(r, b->place, "%s: its value depends on itself without a state in between", b->what);
        else if (r->block_level >= MOST_NESTED_BLOCKS)
            kmp_reader_complain(r, b->place, "%s: more than %d blocks depend on each other at once", b->what,
                                MOST_NESTED_BLOCKS);
        else
            read_block(r, b);
    }
}

static void add_rate(kmp_reader *r, int k, const kmp_expr *rate)
{
    kempe_model *model = r->model;
    model->forces[model->force_count++] = (kmp_force){.name = model->states[k].name,
                                                      .kind = KMP_FORCE_STATE,
                                                      .place = model->states[k].place,
                                                      .motion = kmp_model_coordinates(model) + k,
                                                      .effort = rate};
}

void kmp_add_state_rates(kmp_reader *r)
{
    for (int k = 0; k < r->block_count; k++) {
        block *b = &r->blocks[k];
        if (b->progress == KMP_BLOCK_WAITS)
            read_block(r, b);
        for (int i = 0; b->rate && !r->model->arena.failed && i < b->count; i++)
            add_rate(r, b->first + i, b->rate[i]);
    }
    for (int k = r->first_element_state; k < r->model->state_count; k++)
        add_rate(r, k, zero(r));
}
