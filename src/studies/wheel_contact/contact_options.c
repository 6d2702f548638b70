/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading of the options of a table of contacts. */
#include "model/tables/coordinates.h"
#include "studies/wheel_contact/contact_sweep.h"
#include <kempe/contact.h>
#include <kempe/vehicle.h>
#include <string.h>

enum { USUAL_VALUES = 21, MOST_VALUES = 100000 };

static kempe_context *context_of(const kempe_contacts *t)
{
    return t->given->context;
}

int kmp_contact_hold_of(const kempe_contacts *t, int coordinate)
{
    for (int k = 0; k < t->hold_count; k++)
        if (t->hold[k].coordinate == coordinate)
            return k;
    return -1;
}

/* -- swept quantities ---------------------------------------------------------------------------------- */

static kempe_status add_coordinate(kempe_contacts *t, const kmp_range *range, kmp_contact_lead *lead)
{
    const kempe_model *model = t->given->model;
    int c = -1;
    KMP_TRY(kmp_coordinate_find(model, "sweep", range->name, strlen(range->name), &c));
    KMP_TRY(kmp_range_fits_motion(context_of(t), "sweep", range, model->motions[c].rotation, 0));
    if (kmp_contact_hold_of(t, c) >= 0)
        return kmp_fail(context_of(t), KEMPE_E_ARGUMENT, "--sweep: '%s' is given twice", range->name);
    *lead = (kmp_contact_lead){-1, t->hold_count};
    t->hold[t->hold_count++] = (kmp_steady){.coordinate = c, .how = KMP_RATE_HELD};
    return KEMPE_OK;
}

/* -- the rest ------------------------------------------------------------------------------------------ */

static kempe_status read_hold(kempe_contacts *t, const char *words)
{
    const kempe_model *model = t->given->model;
    int *list = KMP_ARENA_NEW(&t->arena, int, t->given->n), count = 0;
    KMP_TRY(kmp_made(context_of(t), list));
    KMP_TRY(kmp_coordinates_read(model, "hold", words, list, &count));
    for (int k = 0; k < count; k++) {
        if (kmp_contact_hold_of(t, list[k]) >= 0)
            return kmp_fail(context_of(t), KEMPE_E_ARGUMENT, "hold: '%s' is swept", model->motions[list[k]].name);
        t->hold[t->hold_count++] = (kmp_steady){.coordinate = list[k], .how = KMP_RATE_HELD};
    }
    return KEMPE_OK;
}

static const char rolling_word[] = "half-space";

const char *kmp_contact_law_word(const kempe_contacts *t)
{
    return t->rolls ? rolling_word : t->has_law ? kempe_contact_law_name(t->law) : NULL;
}

static kempe_status read_law(kempe_contacts *t, const char *word)
{
    kmp_text sentence = {0};
    const char *name;
    for (int law = KEMPE_CREEP_NONE; word && (name = kempe_contact_law_name((kempe_creep_law)law)) != NULL; law++) {
        if (strcmp(name, word) == 0) {
            t->has_law = true;
            t->law = (kempe_creep_law)law;
        }
        if (law == KEMPE_CREEP_NONE)
            kmp_text_printf(&sentence, "unknown creep law '%s'; available: %s", word, name);
        else
            kmp_text_printf(&sentence, ", %s", name);
    }
    kmp_text_printf(&sentence, ", %s", rolling_word);
    t->rolls = word && strcmp(word, rolling_word) == 0;
    t->has_law = t->has_law || t->rolls;
    if (word && !t->has_law)
        return kmp_fail_text(context_of(t), KEMPE_E_ARGUMENT, &sentence);
    kmp_text_free(&sentence);
    return KEMPE_OK;
}

kempe_status kmp_contact_request(kempe_contacts *t, const kempe_contact_options *options)
{
    kempe_context *context = context_of(t);
    if (t->given->model->wheel_count == 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "the model has no wheels: define them in the section 'wheels' (docs/model/wheels.md)");
    if (!options->sweep || !*options->sweep)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "the sweep is missing: a coordinate or a parameter with its range, as in 'y=0:10 mm:21'");
    t->hold = KMP_ARENA_NEW(&t->arena, kmp_steady, t->given->n);
    KMP_TRY(kmp_made(context, t->hold));
    KMP_TRY(kmp_ranges_read(context, options->sweep, &t->over));
    if (t->over.count > t->given->n + t->given->model->parameter_count)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "--sweep: there are more ranges than coordinates and parameters");
    t->lead = KMP_ARENA_NEW(&t->arena, kmp_contact_lead, t->over.count);
    KMP_TRY(kmp_made(context_of(t), t->lead));
    for (int k = 0; k < t->over.count; k++)
        if (kmp_parameter_find(t->given->model, t->over.range[k].name) >= 0)
            t->lead[k] = (kmp_contact_lead){t->parameter_count++, -1};
        else
            KMP_TRY(add_coordinate(t, &t->over.range[k], &t->lead[k]));
    int points = options->points;
    int count = points;
    bool varies = false;
    for (int k = 0; k < t->over.count; k++) {
        const kmp_range *range = &t->over.range[k];
        count = count == 0 && range->count > 1 ? range->count : count;
        varies = varies || range->from != range->to;
    }
    t->requested = count != 0 ? count : varies ? USUAL_VALUES : 1;
    if (t->requested < 1 || t->requested > MOST_VALUES || (t->requested == 1 && varies))
        return kmp_fail(context_of(t), KEMPE_E_ARGUMENT, "--sweep: %d values are not possible: 2 to %d", t->requested,
                        MOST_VALUES);
    KMP_TRY(read_hold(t, options->hold));
    KMP_TRY(read_law(t, options->law));
    KMP_TRY(kmp_contact_pressure_request(t, options->pressure ? options->pressure : t->rolls ? "half-space" : NULL));
    if (t->rolls && t->pressure != KMP_PRESSURE_HALF_SPACE)
        return kmp_fail(
            context, KEMPE_E_ARGUMENT,
            "--law half-space: the forces belong to the pressures of a grid: give --pressure half-space, or "
            "no --pressure");
    return kmp_contact_conicity_request(t, options);
}
