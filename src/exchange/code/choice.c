/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/code/choice.h"
#include "base/context.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "dynamics/kinematics/link_tree.h"
#include "dynamics/load_dependent.h"
#include "exchange/code/simulated.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/language/expression_value.h"
#include "model/read/loads.h"
#include <string.h>

static const char *const schemes[] = {[KMP_SCHEME_COMPOSITE] = "composite", [KMP_SCHEME_NER] = "ner"};

/* The sets of a name, or of several with + between. */
static kempe_status read_sum(kempe_context *context, const char *name, size_t length, unsigned *sets)
{
    *sets = 0;
    for (size_t at = 0; at <= length;) {
        size_t part = strcspn(name + at, "+,");
        part = at + part > length ? length - at : part;
        unsigned found = kmp_sets_find(name + at, part);
        if (!found) {
            kmp_text sentence = {0};
            kmp_text_printf(&sentence, "unknown set '%.*s'; sets are ", (int)part, name + at);
            kmp_sets_list(&sentence);
            kmp_text_put(&sentence, ", and several of them joined by +");
            return kmp_fail_text(context, KEMPE_E_ARGUMENT, &sentence);
        }
        *sets |= found;
        at += part + 1;
    }
    return KEMPE_OK;
}

static kempe_status add(kempe_context *context, kmp_set_choice *choice, const char *name, size_t length)
{
    unsigned sets;
    KMP_TRY(read_sum(context, name, length, &sets));
    for (int k = 0; k < choice->count; k++)
        if (choice->chosen[k].sets == sets)
            return KEMPE_OK;
    if (length >= KMP_CHOICE_NAME || choice->count == KMP_MOST_CHOSEN)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "--sets: at most %d sets or sums of them, each of fewer than %d characters", KMP_MOST_CHOSEN,
                        KMP_CHOICE_NAME);
    kmp_chosen *c = &choice->chosen[choice->count++];
    memcpy(c->name, name, length);
    c->sets = sets;
    choice->all |= sets;
    return KEMPE_OK;
}

static kempe_status read_scheme(kempe_context *context, const char *name, kmp_set_choice *choice)
{
    for (int k = 0; name && k < (int)(sizeof schemes / sizeof *schemes); k++)
        if (strcmp(schemes[k], name) == 0)
            choice->scene.scheme = (kmp_scheme)k;
    choice->scheme = schemes[choice->scene.scheme];
    if (name && strcmp(choice->scheme, name) != 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "unknown scheme '%s'; schemes are composite, ner", name);
    return KEMPE_OK;
}

/* Bodies without inputs have to exist, but may have no motion, and then no inputs anyway. */
static kempe_status check_bodies(const kempe_model *model, const char *names)
{
    size_t length = 0;
    for (const char *name = names; name && *name; name += length + (name[length] == ',')) {
        bool found = false;
        length = strcspn(name, ",");
        for (int b = 1; b < model->body_count && !found; b++)
            found = strlen(model->bodies[b].name) == length && strncmp(model->bodies[b].name, name, length) == 0;
        if (!found)
            return kmp_fail(model->context, KEMPE_E_ARGUMENT, "--no-inputs: unknown body '%.*s' in '%s'", (int)length,
                            name, model->name);
    }
    return KEMPE_OK;
}

/* Sets whose rows are elements or outputs of the model, which may have none. */
static kempe_status check_rows(const kempe_model *model, unsigned sets)
{
    const unsigned of_friction = kmp_sets_find("friction", strlen("friction"));
    const unsigned of_contacts = kmp_sets_find("contact", strlen("contact")) | 1u << KMP_EQ_IMPACT;
    if (sets & of_contacts && !kmp_model_has_contacts(model))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the sets 'contact' and 'impact' are empty: '%s' has no rigid contacts; omit them",
                        model->name);
    if (sets & of_friction && !kmp_model_sticks(model))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'friction' is empty: '%s' has no friction that sticks; omit the set", model->name);
    if (sets & kmp_sets_find("discrete", strlen("discrete")) && !kmp_model_has_samples(model))
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'discrete' is empty: '%s' has no states with samples or events; omit the set",
                        model->name);
    if (sets & kmp_sets_find("delay", strlen("delay")) && model->delay_count == 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'delay' is empty: '%s' has no continuous delays; omit the set", model->name);
    if (sets & 1u << KMP_EQ_OUTPUTS && kmp_outputs_width(model) == 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT,
                        "the set 'outputs' is empty: '%s' lists no output under 'run' that q, qd, qdd and lambda are "
                        "not already; list some, or omit the set",
                        model->name);
    return KEMPE_OK;
}

/* True if the equations have values that are found by iterations. Places and guesses where these begin are numbers. */
static bool is_solved(const kempe_model *model)
{
    bool found = model->wheel_count > 0;
    for (int k = 0; k < model->unknowns_count; k++)
        found = found || model->unknowns[k].count > 0;
    return found;
}

void kmp_choice_free(kmp_set_choice *choice)
{
    kmp_events_free(&choice->modes);
}

kempe_status kmp_choice_read(const kempe_model *model, const kempe_generate_options *g, kmp_set_choice *choice)
{
    kempe_context *context = model->context;
    *choice = (kmp_set_choice){.scene = {.scheme = KMP_SCHEME_COMPOSITE,
                                         .keep = g->simulator && is_solved(model) ? KMP_KEEP_NOTHING
                                                 : g->simulator                   ? KMP_KEEP_PARAMETERS
                                                 : g->keep_parameters             ? KMP_KEEP_NUMBERS
                                                                                  : KMP_KEEP_NOTHING,
                                         .body_inputs = g->body_inputs,
                                         .no_inputs = g->no_inputs,
                                         .optimize = g->optimize,
                                         .loops_alone = !g->drives && !g->simulator && !kmp_uses_drives(model),
                                         .events = &choice->modes,
                                         .given_delays = true,
                                         .charted = g->simulator,
                                         .modes_alone = !g->simulator}};
    for (int k = 0; k < model->parameter_count && choice->scene.keep != KMP_KEEP_NOTHING; k++)
        if (kmp_extent_is_long(model->parameters[k].extent))
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "generated code keeps parameter '%s' as a symbol, which has %.3g operations and operands "
                            "when the parameters in it are expanded, in %d levels; at most %d and %d are allowed: use "
                            "fewer parameters within parameters, or give '%s' as a number",
                            model->parameters[k].name, model->parameters[k].extent.size,
                            model->parameters[k].extent.level, KMP_MOST_WRITTEN_OUT, KMP_MOST_NAME_LEVELS,
                            model->parameters[k].name);
    KMP_TRY(read_scheme(context, g->scheme, choice));
    if (g->simulator) {
        KMP_TRY(kmp_simulated_check(model));
        kmp_simulated_choose(model, choice);
        return KEMPE_OK;
    }
    for (const char *s = g->sets ? g->sets : "M_C,invdyn,h_J,jdqd"; s; s = strchr(s, ',')) {
        s += *s == ',';
        KMP_TRY(add(context, choice, s, strcspn(s, ",")));
    }
    KMP_TRY(check_rows(model, choice->all));
    return check_bodies(model, g->no_inputs);
}
