/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading of an inverse equilibrium: released parameters and rates, fixed coordinates, targets of outputs; their
 * numbers must be equal. The released parameters then are inputs of a variant. */
#include "analyses/equilibrium/exchange.h"
#include "analyses/equilibrium/friction_at_rest.h"
#include "analyses/parts/ranges.h"
#include "backend/machine.h"
#include "base/memory.h"
#include "constraints/inexact/nearest_exact.h"
#include "constraints/tolerances.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include "model/read/requests.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

/* -- released quantities ----------------------------------------------------------------------------- */

/* "qd(shaft)" */
static bool is_rate(const char *word)
{
    size_t length = strlen(word);
    return length > 4 && strncmp(word, "qd(", 3) == 0 && word[length - 1] == ')';
}

static kempe_status read_release(kmp_exchange *x, const kempe_model *model, const char *list, const kmp_steady *rates,
                                 int rate_count)
{
    char **word;
    int count = kmp_text_words(&x->arena, list, &word);
    KMP_TRY(kmp_made(model->context,
                     KMP_ARENA_MAKE(&x->arena, KMP_ROOM(const char *, count, &x->name), KMP_ROOM(int, count, &x->rate),
                                    KMP_ROOM(double, count, &x->value, &x->trial, &x->given))));
    for (int k = 0; k < count; k++)
        if (!is_rate(word[k])) {
            int at = kmp_parameter_find(model, word[k]);
            x->value[x->free_count] = at < 0 ? 0 : model->parameters[at].number.value;
            x->name[x->free_count++] = word[k];
        }
    x->parameter_count = x->free_count;
    KMP_TRY(kmp_variant_new(model, x->parameter_count, x->name, &x->variant));
    for (int k = 0; k < count; k++) {
        int c = -1, at = 0;
        if (!is_rate(word[k]))
            continue;
        KMP_TRY(kmp_coordinate_find(model, "solve-for", word[k] + 3, strlen(word[k]) - 4, &c));
        while (at < rate_count && rates[at].coordinate != c)
            at++;
        if (at == rate_count)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                            "--solve-for: the rate of '%s' needs a start value: give it (--rates %s=..)",
                            model->motions[c].name, model->motions[c].name);
        x->rate[x->free_count - x->parameter_count] = at;
        x->value[x->free_count] = rates[at].rate;
        x->name[x->free_count++] = word[k];
    }
    memcpy(x->given, x->value, (size_t)x->free_count * sizeof *x->given);
    return KEMPE_OK;
}

/* -- fixed and required quantities ------------------------------------------------------------------- */

/* A target of a range, which must be one value. */
static kempe_status add_target(kmp_exchange *x, const char *option, const kmp_range *range, kmp_exchange_target **added)
{
    kempe_context *context = kmp_variant_model(x->variant)->context;
    kmp_exchange_target *target = *added = &x->target[x->target_count++];
    KMP_TRY(kmp_range_is_value(context, option, range));
    *target = (kmp_exchange_target){.coordinate = -1, .value = range->from};
    target->name = kmp_arena_strdup(&x->arena, range->name);
    return target->name ? KEMPE_OK : kmp_fail_memory(context);
}

/* The index of output `of`, component `part`, among the values shown. */
static int place_of(const kempe_model *model, kmp_output of, int part)
{
    int at = 0;
    for (int k = 0; k < model->output_count; k++) {
        if (kmp_output_equal(&model->outputs[k], &of))
            return at + part;
        at += kmp_output_width(model, &model->outputs[k]);
    }
    return -1;
}

/* The one component that a word selects; -1 after an error message. */
static int single_part(const kempe_model *model, const kmp_output *of, unsigned parts, const char *word)
{
    int width = kmp_output_width(model, of);
    if (width == 1)
        return 0;
    for (int k = 0; k < width; k++)
        if (parts == 1u << k)
            return k;
    if (width == 0)
        (void)kmp_fail(model->context, KEMPE_E_ARGUMENT,
                       "--target: '%s' is not an output that can have a target; hold coordinates by --hold", word);
    else
        (void)kmp_fail(model->context, KEMPE_E_ARGUMENT, "--target: '%s' has %d components: name one, as in '%s%s'",
                       word, width, word, of->kind == KMP_OUTPUT_ENERGY ? ".potential" : ".x");
    return -1;
}

static kempe_status add_targets(kmp_exchange *x, const kempe_model *model, const kmp_ranges *fixed,
                                const kmp_ranges *required)
{
    x->target = KMP_ARENA_NEW(&x->arena, kmp_exchange_target, fixed->count + required->count);
    KMP_TRY(kmp_made(model->context, x->target));
    for (int k = 0; k < fixed->count; k++) {
        kmp_exchange_target *target;
        KMP_TRY(add_target(x, "hold", &fixed->range[k], &target));
        KMP_TRY(kmp_coordinate_find(model, "hold", target->name, strlen(target->name), &target->coordinate));
        KMP_TRY(kmp_range_fits_motion(model, "hold", &fixed->range[k], target->coordinate, 0));
    }
    /* Reads each word separately, to know its meaning; then all of them, for the system. */
    kempe_model *copy = kmp_variant_model(x->variant);
    kmp_output *of = KMP_ARENA_NEW(&x->arena, kmp_output, required->count);
    kmp_text list = {0};
    unsigned *parts = NULL;
    const int from = x->target_count, own = model->output_count;
    for (int k = 0; k < required->count; k++)
        kmp_text_printf(&list, "%s%s", k ? "," : "", required->range[k].name);
    char *all = kmp_text_keep(&list, &x->arena);
    KMP_TRY(kmp_made(copy->context, !x->arena.failed));
    for (int k = 0; k < required->count; k++) {
        kmp_exchange_target *target;
        KMP_TRY(add_target(x, "target", &required->range[k], &target));
        KMP_TRY(kmp_requested_outputs(copy, target->name, &parts));
        of[k] = copy->outputs[0];
        target->shown = single_part(copy, &of[k], parts[0], target->name);
        if (target->shown < 0)
            return KEMPE_E_ARGUMENT;
        KMP_TRY(
            kmp_range_fits_unit(model, "target", &required->range[k], kmp_output_unit(copy, &of[k], target->shown)));
    }
    KMP_TRY(required->count > 0 ? kmp_requested_outputs(copy, all, &parts) : KEMPE_OK);
    /* The outputs of the model, then the outputs of targets. */
    kmp_output *outputs = KMP_ARENA_NEW(&copy->arena, kmp_output, own + required->count);
    KMP_TRY(kmp_made(copy->context, outputs));
    for (int k = 0; k < own; k++)
        outputs[k] = model->outputs[k];
    copy->outputs = outputs;
    copy->output_count = own;
    for (int k = 0; k < required->count; k++)
        if (place_of(copy, of[k], 0) < 0)
            outputs[copy->output_count++] = of[k];
    for (int k = 0; k < required->count; k++)
        x->target[from + k].shown = place_of(copy, of[k], x->target[from + k].shown);
    return KEMPE_OK;
}

/* -- the exchange ------------------------------------------------------------------------------------ */

kempe_status kmp_exchange_new(const kempe_system *system, const char *fix, const char *require, const char *release,
                              const kmp_steady *rates, int rate_count, kmp_exchange **exchange)
{
    KMP_MAKE(system->context, kmp_exchange, x);
    kmp_ranges fixed = {0}, required = {0};
    kempe_status status = read_release(x, system->model, release, rates, rate_count);
    if (status == KEMPE_OK && fix)
        status = kmp_ranges_read(system->context, fix, &fixed);
    if (status == KEMPE_OK && require)
        status = kmp_ranges_read(system->context, require, &required);
    if (status == KEMPE_OK)
        status = add_targets(x, system->model, &fixed, &required);
    const bool outputs = required.count > 0;
    kmp_ranges_free(&fixed);
    kmp_ranges_free(&required);
    if (status == KEMPE_OK)
        status = kmp_system_of_variant(x->variant, &x->system);
    if (status == KEMPE_OK)
        status = kmp_slopes_new(x->system, kmp_backend_default(), x->parameter_count, x->name, outputs, &x->slopes);
    return KMP_GIVE_OR_FREE(status, exchange, x, kmp_exchange_free);
}

KMP_FREES(kmp_exchange, exchange, kmp_slopes_free(exchange->slopes), kempe_system_free(exchange->system),
          kmp_text_free(&exchange->why), kmp_variant_free(exchange->variant), kmp_arena_free(&exchange->arena))

void kmp_exchange_begin(kmp_exchange *exchange, kmp_linear *linear, kmp_steady *rates)
{
    memcpy(exchange->value, exchange->given, (size_t)exchange->free_count * sizeof *exchange->value);
    (void)kmp_exchange_set(exchange, exchange->value, linear, rates);
}

bool kmp_exchange_set(kmp_exchange *exchange, const double *values, kmp_linear *linear, kmp_steady *rates)
{
    for (int k = exchange->parameter_count; k < exchange->free_count; k++)
        rates[exchange->rate[k - exchange->parameter_count]].rate = values[k];
    if (exchange->parameter_count == 0)
        return true;
    if (kmp_linear_vary(linear, exchange->system, exchange->variant, values) != KEMPE_OK) {
        kmp_text_free(&exchange->why);
        kmp_text_put(&exchange->why, kempe_context_message(exchange->system->context));
        kmp_context_clear(exchange->system->context);
        return false;
    }
    kmp_slopes_renew_parameters(exchange->slopes);
    return true;
}

/* -- the set of pressing contacts --------------------------------------------------------------------------- */

/* Pressing contacts by an active set: surfaces that are met become rows of J, and the contact that pulls most leaves at
 * an equilibrium. */

enum { MOST_PASSES = 20, PASSES_OF_CONTACT = 4 };

static bool touches(const kmp_contact_set *x, int i)
{
    return x->gap[i] <= KMP_TOUCH_NEAR * x->state->view[i].size;
}

static bool overlaps(const kmp_contact_set *x, int i)
{
    return x->gap[i] < -KMP_TOUCH_NEAR * x->state->view[i].size;
}

kempe_status kmp_contact_set_begin(kmp_linear *linear, double t, const double *q, bool keeps, kmp_arena *arena,
                                   kmp_contact_set **set)
{
    kempe_context *context = linear->system->context;
    bool none;
    *set = NULL;
    if (keeps || !kmp_model_has_contacts(linear->system->model))
        return KEMPE_OK;
    kmp_contact_set *x = KMP_ARENA_NEW(arena, kmp_contact_set, 1);
    KMP_TRY(kmp_made(context, x));
    KMP_TRY(kmp_friction_state_new(linear->eval, &x->state, &none));
    *set = x;
    x->count = x->state->count;
    x->struck = -1;
    x->context = context;
    KMP_TRY(kmp_made(context, KMP_ARENA_MAKE(arena, KMP_ROOM(kmp_normal_load, x->count, &x->closed),
                                             KMP_ROOM(double, x->count, &x->gap))));
    kmp_contact_set_look(x, t, q);
    for (int i = 0; i < x->count; i++)
        x->closed[i] = touches(x, i) || kmp_friction_state_closed(x->state, i) ? KMP_PRESSED : KMP_PRESSED_NOT;
    return kmp_contact_set_press(x, t, q);
}

void kmp_contact_set_touch(kmp_contact_set *set, double t, const double *q)
{
    kmp_contact_set_look(set, t, q);
    for (int i = 0; i < set->count; i++)
        set->closed[i] = touches(set, i) ? KMP_PRESSED : KMP_PRESSED_NOT;
}

void kmp_contact_set_end(kmp_contact_set *set)
{
    if (set)
        kmp_friction_state_free(set->state);
}

kempe_status kmp_contact_set_press(kmp_contact_set *set, double t, const double *q)
{
    return kmp_friction_state_press(set->state, t, q, set->closed);
}

void kmp_contact_set_look(kmp_contact_set *set, double t, const double *q)
{
    kmp_friction_state_measure(set->state, t, q, set->gap);
}

int kmp_contact_set_overlap(const kmp_contact_set *set)
{
    int worst = -1;
    double most = 0;
    for (int i = 0; i < set->count; i++) {
        const kmp_friction_view *view = &set->state->view[i];
        bool held = set->closed[i] && view->word == KMP_FRICTION_WORD_STICKS;
        if (view->contact && !held && overlaps(set, i) && -set->gap[i] > most * view->size) {
            most = -set->gap[i] / view->size;
            worst = i;
        }
    }
    return worst;
}

/* The force of a closed contact, in J of its size. */
static double pushed_by(const kmp_contact_set *x, const kmp_linear *l, int i)
{
    for (int r = 0; x->closed[i] && r < l->m; r++)
        if (l->system->rows[r].closure == x->state->view[i].element->closure)
            return l->lambda[r] * x->state->view[i].size;
    return 0;
}

/* The closed contact that pulls most; -1: none. */
static int find_pull(const kmp_contact_set *x, const kmp_linear *l, double work)
{
    int worst = -1;
    for (int i = 0; i < x->count; i++)
        work = fmax(work, fabs(pushed_by(x, l, i)));
    double most = -KMP_CONTACT_NONE * work;
    for (int i = 0; i < x->count; i++) {
        double pushed = pushed_by(x, l, i);
        if (pushed < most) {
            most = pushed;
            worst = i;
        }
    }
    return worst;
}

kempe_status kmp_contact_set_exchange(kmp_contact_set *set, const kmp_linear *linear, double work, bool *agrees)
{
    kmp_contact_set_look(set, linear->t, linear->q);
    int enters = kmp_contact_set_overlap(set), leaves = enters < 0 ? find_pull(set, linear, work) : -1;
    int changed = enters >= 0 ? enters : leaves;
    *agrees = changed < 0;
    set->struck = enters;
    if (*agrees) {
        /* Contacts that the closed ones keep closed as well, whatever their forces. */
        bool any = false;
        for (int i = 0; i < set->count; i++)
            if (set->state->view[i].contact && set->closed[i] == KMP_PRESSED_NOT && touches(set, i)) {
                set->closed[i] = KMP_PRESSED_IF_IMPLIED;
                any = true;
            }
        return any ? kmp_contact_set_press(set, linear->t, linear->q) : KEMPE_OK;
    }
    KMP_TRY(enters >= 0 && set->closed[enters] ? kmp_contact_set_check(set) : KEMPE_OK);
    if (++set->passes > MOST_PASSES + PASSES_OF_CONTACT * set->count)
        return kmp_fail(linear->system->context, KEMPE_E_FAILED,
                        "no equilibrium is found: no combination of open and closed contacts is consistent ('%s' %s in "
                        "the last of %d that were tried); start from another position",
                        set->state->view[changed].element->name, enters >= 0 ? "overlaps" : "pulls", set->passes);
    set->closed[changed] = enters >= 0 ? KMP_PRESSED : KMP_PRESSED_NOT;
    return KEMPE_OK;
}

kempe_status kmp_contact_set_check(const kmp_contact_set *set)
{
    if (set->struck < 0 || set->state->view[set->struck].word != KMP_FRICTION_WORD_SHARES)
        return KEMPE_OK;
    return kmp_fail(set->context, KEMPE_E_FAILED,
                    "no equilibrium is found: closures and closed contacts keep '%s' overlapping by %.3g; start from "
                    "another position",
                    set->state->view[set->struck].element->name, -set->gap[set->struck]);
}
