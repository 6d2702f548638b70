/* SPDX-License-Identifier: BSD-3-Clause */
/* Actuators and their weights, as users name them (actuators.h). A user who gives none is told
 * which coordinates would move the mechanism. */
#include "analyses/inverse/actuators.h"
#include "analyses/parts/ranges.h"
#include "base/context.h"
#include "base/text.h"
#include "constraints/closing/assemble.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/partition/partition.h"
#include "model/data/closure_table.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/language/dimension.h"
#include "model/read/loads.h"
#include <string.h>

enum { MOST_CANDIDATES = 12 };

/* Suitable coordinates as "a,b", and their number; -1 where the loops do not close. False: no memory. */
static bool print_candidates(const kempe_system *s, int *freedoms, kmp_text *text)
{
    kempe_assembly *a = NULL;
    kmp_partition part = {0};
    kmp_evaluator *eval = kmp_eval_new(s, kmp_backend_default());
    kempe_status status = eval ? kmp_assembly_at_start(s, &a) : KEMPE_E_MEMORY;
    if (status == KEMPE_OK) {
        kmp_eval_closure(eval, 0, a->q);
        status = kmp_partition_init(&part, s, eval->jacobian, NULL, 0);
    }
    *freedoms = status == KEMPE_OK ? part.p : -1;
    for (int k = 0; k < *freedoms && k < MOST_CANDIDATES; k++)
        kmp_text_printf(text, "%s%s", k ? "," : "", s->model->motions[part.u[k]].name);
    kmp_context_clear(s->context);
    kmp_partition_free(&part);
    kempe_assembly_free(a);
    kmp_eval_free(eval);
    return status != KEMPE_E_MEMORY && !text->failed;
}

static kempe_status fail_without_actuators(const kempe_system *s)
{
    static const char *const list = "'kempe show --model' lists all coordinates";
    kmp_text text = {0};
    int freedoms;
    kempe_status status;
    if (!print_candidates(s, &freedoms, &text))
        status = kmp_fail_memory(s->context);
    else if (freedoms == 0)
        status = kmp_fail(s->context, KEMPE_E_ARGUMENT,
                          "no actuators are given, but the mechanism has no degree of freedom and needs none");
    else if (freedoms < 0)
        status = kmp_fail(s->context, KEMPE_E_ARGUMENT, "no actuators are given: %s", list);
    else
        status = kmp_fail(s->context, KEMPE_E_ARGUMENT,
                          "no actuators are given: the mechanism has %d degree%s of freedom; --actuators %s%s would "
                          "move it; %s",
                          freedoms, freedoms == 1 ? "" : "s", text.s, freedoms > MOST_CANDIDATES ? ",.." : "", list);
    kmp_text_free(&text);
    return status;
}

static kempe_status read_weight(kmp_actuators *actuators, const kempe_system *s, const kmp_range *range)
{
    int k = 0, coordinate;
    KMP_TRY(kmp_coordinate_find(s->model, "weights", range->name, strlen(range->name), &coordinate));
    while (k < actuators->count && actuators->coordinate[k] != coordinate)
        k++;
    if (k == actuators->count)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "weights: '%s' is not an actuator", range->name);
    if (range->count != 1 || !(range->from > 0) || range->dimension.kind != KMP_DIMENSION_BARE)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "weights: a positive number without unit is expected for '%s'",
                        range->name);
    actuators->weight[k] = range->from;
    return KEMPE_OK;
}

bool kmp_is_drive_of_user(const kempe_model *model, int closure)
{
    const kmp_closure *of = &model->closures[closure];
    return kmp_closure_is_drive(of) && !kmp_motion_is_for_load(model, of->motion);
}

kempe_status kmp_actuators_read(kmp_actuators *actuators, kmp_arena *arena, const kempe_system *system,
                                const kempe_inverse_options *options)
{
    const kempe_model *model = system->model;
    kmp_actuators *a = actuators;
    kmp_ranges weights = {0};
    kempe_status status = KEMPE_OK;
    KMP_TRY(kmp_made(system->context, KMP_ARENA_MAKE(arena, KMP_ROOM(int, system->n, &a->coordinate),
                                                     KMP_ROOM(double, system->n, &a->weight))));
    KMP_TRY(kmp_coordinates_read(model, "actuators", options->actuators, a->coordinate, &a->count));
    for (int c = 0, given = a->count; given == 0 && c < model->closure_count; c++)
        if (kmp_is_drive_of_user(model, c))
            a->coordinate[a->count++] = model->closures[c].motion;
    if (a->count == 0)
        return fail_without_actuators(system);
    for (int k = 0; k < a->count; k++)
        a->weight[k] = 1;
    if (!options->weights)
        return KEMPE_OK;
    KMP_TRY(kmp_ranges_read(system->context, options->weights, &weights));
    for (int w = 0; w < weights.count && status == KEMPE_OK; w++)
        status = read_weight(a, system, &weights.range[w]);
    a->weighted = weights.count > 0;
    kmp_ranges_free(&weights);
    return status;
}
