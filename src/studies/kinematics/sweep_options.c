/* SPDX-License-Identifier: BSD-3-Clause */
/* Reads names and ranges of a sweep: driven coordinates and time, fixed coordinates, and deactivated drives. Driven
 * coordinates are then compared with the degrees of freedom. */
#include "base/context.h"
#include "model/expressions/ranges.h"
#include "model/tables/nearest.h"
#include "output/quantity.h"
#include "studies/kinematics/position_sweep.h"
#include <kempe/kinematics.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* rad; and the radians of a turn. */
#define MANY_TURNS 45.0
#define TURN       6.283185307179586

enum { DEFAULT_ROWS = 361, MOST_NAME = 256, MOST_ROWS = 1000000 };

static bool is_coordinate(const kempe_model *model, int k, const char *name)
{
    char numbered[MOST_NAME];
    const kmp_motion *m = &model->motions[k];
    int length = snprintf(numbered, sizeof numbered, "%s.%d", model->bodies[m->body].joint, m->number);
    return strcmp(m->name, name) == 0 || (length > 0 && length < MOST_NAME && strcmp(numbered, name) == 0);
}

/* A drive or lock of the model; -1: none is called so. */
static int find_drive(const kempe_model *model, const char *name)
{
    for (int c = 0; c < model->closure_count; c++)
        if (kmp_closure_is_drive(&model->closures[c]) && strcmp(model->closures[c].name, name) == 0)
            return c;
    return -1;
}

/* Reports an unknown name, with the nearest one. */
static kempe_status refuse_name(const kempe_model *model, const char *name, bool coordinates, const char *word)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    kmp_text sentence = {0};
    for (int k = 0; coordinates && k < model->motion_count; k++)
        kmp_nearest_offer(&nearest, model->motions[k].name);
    for (int c = 0; c < model->closure_count; c++)
        if (kmp_closure_is_drive(&model->closures[c]))
            kmp_nearest_offer(&nearest, model->closures[c].name);
    kmp_text_printf(&sentence, "'%s' is not a %s of '%s'%s", name, word, model->name, coordinates ? ", and not t" : "");
    kmp_nearest_suggest(&nearest, &sentence);
    return kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &sentence);
}

/* The coordinate of a name, which may be that of its drive; -1: the time. */
static kempe_status find(const kempe_model *model, const char *name, int *coordinate)
{
    int drive = find_drive(model, name);
    *coordinate = drive >= 0 ? model->closures[drive].motion : -2;
    for (int k = 0; k < model->motion_count; k++)
        if (is_coordinate(model, k, name))
            *coordinate = k;
    if (*coordinate == -2 && strcmp(name, "t") == 0)
        *coordinate = -1;
    return *coordinate == -2 ? refuse_name(model, name, true, "coordinate or drive") : KEMPE_OK;
}

const char *kmp_kinematics_name(const kempe_kinematics *k, const kmp_lead *lead)
{
    return lead->coordinate < 0 ? "t" : k->system->model->motions[lead->coordinate].name;
}

const char *kmp_kinematics_unit(const kempe_kinematics *k, const kmp_lead *lead)
{
    return lead->coordinate < 0 ? "s" : kmp_quantity_unit(k->system, KMP_QUANTITY_Q, lead->coordinate);
}

static kempe_status add_lead(kempe_kinematics *k, const kmp_range *range)
{
    kempe_context *context = k->system->context;
    const char *name = range->name;
    kmp_lead lead = {0, range->from, range->to};
    KMP_TRY(find(k->system->model, name, &lead.coordinate));
    if (lead.coordinate < 0)
        KMP_TRY(kmp_range_fits(context, "sweep", range, KMP_DIM_TIME));
    else
        KMP_TRY(kmp_range_fits_motion(context, "sweep", range, k->system->model->motions[lead.coordinate].rotation, 0));
    if (lead.coordinate >= 0 && k->system->model->motions[lead.coordinate].rotation) {
        /* Bare numbers of an angle are in rad: many turns are rather degrees. */
        double most = fmax(fabs(range->from), fabs(range->to));
        if (range->dimension.kind == KMP_DIMENSION_BARE && !range->angle[1] && most >= MANY_TURNS)
            kmp_log(k->system->context, KEMPE_LOG_WARNING,
                    "the sweep of '%s' from %g to %g is in rad, up to %.3g turns: for degrees write '%g deg'",
                    range->name, range->from, range->to, most / TURN, range->to);
    }
    for (int i = 0; i < k->lead_count; i++)
        if (k->lead[i].coordinate == lead.coordinate)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "'%s' is swept or held twice", name);
    if (lead.coordinate < 0)
        k->time = k->lead_count;
    k->lead[k->lead_count++] = lead;
    return KEMPE_OK;
}

static kempe_status add_ranges(kempe_kinematics *k, const kmp_ranges *ranges)
{
    for (int i = 0; i < ranges->count; i++)
        KMP_TRY(add_lead(k, &ranges->range[i]));
    k->driven = k->lead_count;
    for (int i = k->driven - 1; i >= 0; i--)
        if (k->lead[i].from != k->lead[i].to)
            k->first = i;
    if (k->first >= 0)
        return KEMPE_OK;
    return kmp_fail(k->system->context, KEMPE_E_ARGUMENT,
                    "nothing is swept: give at least one range between different values, NAME=A:B");
}

/* Deactivates drives and locks of coordinates that the user drives, and those named. */
static kempe_status release(kempe_kinematics *k, int count, char *const *names)
{
    const kempe_model *model = k->system->model;
    for (int c = 0; c < model->closure_count; c++)
        for (int i = 0; i < k->driven; i++)
            if (k->lead[i].coordinate >= 0 && kmp_closure_is_drive(&model->closures[c]) &&
                model->closures[c].motion == k->lead[i].coordinate)
                k->released[c] = true;
    for (int i = 0; i < count; i++) {
        int drive = find_drive(model, names[i]);
        if (drive < 0)
            return refuse_name(model, names[i], false, "drive and not a lock");
        k->released[drive] = true;
    }
    return KEMPE_OK;
}

/* "2", "90 deg/s": a rate of the first swept coordinate. */
static kempe_status read_speed(const kempe_kinematics *k, const char *speed, double *value)
{
    kempe_context *context = k->system->context;
    const kmp_lead *lead = &k->lead[k->first];
    kmp_ranges ranges = {0};
    kmp_text text = {0};
    kmp_text_printf(&text, "%s=%s", kmp_kinematics_name(k, lead), speed);
    kempe_status status = text.failed ? kmp_fail_memory(context) : kmp_ranges_read(context, text.s, &ranges);
    kmp_text_free(&text);
    const kmp_range *range = ranges.range;
    bool good = status == KEMPE_OK && range && ranges.count == 1 && range->count == 1 && range->from > 0;
    if (status == KEMPE_OK)
        status = good ? kmp_range_fits_motion(context, "speed", range,
                                              k->system->model->motions[lead->coordinate].rotation, 1)
                      : kmp_fail(context, KEMPE_E_ARGUMENT, "speed: one positive value is expected, not '%s'", speed);
    *value = good ? range->from : NAN;
    kmp_ranges_free(&ranges);
    return status;
}

static kempe_status take_all(kempe_kinematics *k, const kempe_kinematics_options *options, const kmp_ranges *ranges)
{
    char **held, **released;
    int hold_count = kmp_text_words(&k->arena, options->hold, &held);
    int release_count = kmp_text_words(&k->arena, options->release, &released);
    k->lead = KMP_ARENA_NEW(&k->arena, kmp_lead, ranges->count + hold_count + k->system->model->state_count);
    k->released = KMP_ARENA_NEW(&k->arena, bool, k->system->model->closure_count);
    KMP_TRY(kmp_made(k->system->context, !k->arena.failed));
    KMP_TRY(add_ranges(k, ranges));
    for (int i = 0; i < hold_count; i++) {
        char *name = held[i];
        KMP_TRY(add_lead(k, &(kmp_range){.name = name}));
        if (k->time == k->lead_count - 1)
            return kmp_fail(k->system->context, KEMPE_E_ARGUMENT, "the time cannot be held: without a sweep it is 0");
    }
    /* States keep their values: the integrals that stand for them move nothing, and rest. */
    const kempe_model *model = k->system->model;
    for (int i = 0; i < model->state_count; i++)
        k->lead[k->lead_count++] = (kmp_lead){.coordinate = kmp_model_coordinates(model) + i};
    /* One count for all ranges, from whichever gives it. */
    int points = options->points;
    int count = points;
    for (int i = 0; i < ranges->count; i++) {
        int here = ranges->range[i].count;
        if (here < 2)
            continue;
        if (count > 0 && count != here)
            return kmp_fail(k->system->context, KEMPE_E_ARGUMENT,
                            "all ranges are swept together and need the same number of rows, not %d and %d", count,
                            here);
        count = here;
    }
    k->requested = count > 0 ? count : DEFAULT_ROWS;
    if (k->requested < 2 || k->requested > MOST_ROWS)
        return kmp_fail(k->system->context, KEMPE_E_ARGUMENT, "%d rows are not possible: 2 to %d", k->requested,
                        MOST_ROWS);
    const char *speed = options->speed;
    const kmp_lead *lead = &k->lead[k->first];
    bool timed = k->time >= 0 && k->lead[k->time].from != k->lead[k->time].to;
    if (timed && speed)
        return kmp_fail(k->system->context, KEMPE_E_ARGUMENT,
                        "a speed and a range of t exclude each other: the rate of the time is 1");
    k->speed = timed ? NAN : 1;
    KMP_TRY(speed ? read_speed(k, speed, &k->speed) : KEMPE_OK);
    k->rate = timed ? 1 / (k->lead[k->time].to - k->lead[k->time].from) : k->speed / fabs(lead->to - lead->from);
    return release(k, release_count, released);
}

kempe_status kmp_kinematics_request(kempe_kinematics *k, const kempe_kinematics_options *options)
{
    kmp_ranges ranges;
    k->time = k->first = -1;
    if (!options->sweep || !*options->sweep)
        return kmp_fail(k->system->context, KEMPE_E_ARGUMENT, "the swept coordinate is missing: give 'NAME=A:B'");
    KMP_TRY(kmp_ranges_read(k->system->context, options->sweep, &ranges));
    kempe_status status = take_all(k, options, &ranges);
    kmp_ranges_free(&ranges);
    return status;
}

/* -- check of determinacy ---------------------------------------------------------------------------- */

kempe_status kmp_kinematics_check_leads(kempe_kinematics *k, kmp_sweep *sweep)
{
    const kempe_model *model = k->system->model;
    int have = 0, follows = -1, p = sweep->p - model->state_count;
    int *order = KMP_ARENA_NEW(&k->arena, int, sweep->n + sweep->p);
    bool *given = KMP_ARENA_NEW(&k->arena, bool, sweep->n);
    kmp_text names = {0};
    KMP_TRY(kmp_made(model->context, !k->arena.failed));
    for (int i = 0; i < k->lead_count; i++)
        if (k->lead[i].coordinate >= 0) {
            given[k->lead[i].coordinate] = true;
            have += !kmp_state_of(model, k->lead[i].coordinate);
        }
    int rank = kmp_sweep_order(sweep, given, order);
    KMP_TRY(kmp_made(model->context, rank >= 0));
    for (int i = 0; i < rank; i++)
        given[order[i]] = false;
    for (int c = sweep->n - 1; c >= 0; c--)
        follows = given[c] ? c : follows;
    for (int i = rank; i < sweep->p; i++)
        kmp_text_printf(&names, "%s%s", i > rank ? "," : "", model->motions[order[i]].name);
    const char *would = rank < sweep->p ? kmp_text_keep(&names, &k->arena) : "nothing";
    KMP_TRY(kmp_made(model->context, !k->arena.failed));
    if (have > p) {
        if (p == 0)
            return kmp_fail(
                model->context, KEMPE_E_FAILED,
                "the mechanism has no degree of freedom apart from its own drives and locks: sweep one of them "
                "by its name, deactivate one ('--release NAME'), or sweep the time, t=A:B");
        return kmp_fail(model->context, KEMPE_E_FAILED,
                        "the mechanism has %d degree%s of freedom, but %d coordinates are swept or held: %d too many, "
                        "which would contradict the closures",
                        p, p == 1 ? "" : "s", have, have - p);
    }
    if (follows >= 0) {
        const char *name = model->motions[follows].name;
        if (p == 1)
            return kmp_fail(
                model->context, KEMPE_E_FAILED,
                "'%s' cannot be swept from the assembled position: it is at a dead centre, or it cannot move; "
                "use another start ('start:'), or sweep %s",
                name, would);
        return kmp_fail(model->context, KEMPE_E_FAILED,
                        "'%s' is determined by the other swept or held coordinates, or is at a dead centre in the "
                        "assembled position; sweep or hold %s instead",
                        name, would);
    }
    if (have >= p)
        return KEMPE_OK;
    return kmp_fail(model->context, KEMPE_E_FAILED,
                    "the mechanism has %d degree%s of freedom and %d coordinate%s swept or held: sweep or hold %d "
                    "more, for instance %s ('--hold %s' keeps %s as assembled)",
                    p, p == 1 ? "" : "s", have, have == 1 ? " is" : "s are", p - have, would, would,
                    p - have == 1 ? "it" : "them");
}
