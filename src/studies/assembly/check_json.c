/* SPDX-License-Identifier: BSD-3-Clause */
/* `check` as one object. Keys of the contract first; unknown numbers are null. */
#include "model/data/model.h"
#include "model/write/model_json.h"
#include "model/write/model_print.h"
#include "studies/assembly/check_print.h"
#include <kempe/check.h>
#include <math.h>

typedef void writer(kmp_text *text, const kempe_check *check);

static const char *motion_name(const kempe_check *check, int k)
{
    return k < 0 ? NULL : check->system->model->motions[k].name;
}

static void json_rows(kmp_json *json, const char *key, const kempe_check *check, int count, const int *rows)
{
    kmp_print_names(json, key, check->system, kmp_name_of_row, count, rows);
}

/* A sentence as text, null when it is empty. */
static void json_sentence(kmp_json *json, const char *key, const kempe_check *check, writer *write)
{
    kmp_text line = {0};
    write(&line, check);
    kmp_json_string(json, key, line.s && line.length > 0 ? line.s : NULL);
    kmp_text_free_part(json->text, &line);
}

static void json_redundancy(kmp_json *json, const kempe_check *check)
{
    const kmp_diagnosis *d = &check->diagnosis;
    kmp_json_array(json, "dependent");
    for (int k = 0; k < d->set_count; k++) {
        kmp_json_object(json, NULL);
        json_rows(json, "rows", check, d->sets[k].count, d->sets[k].rows);
        kmp_json_put(json, "when %s }", !d->moved ? NULL : d->sets[k].always ? "always" : "here");
    }
    kmp_json_end(json);
    json_rows(json, "reactions_not_unique", check, d->shared_count, d->shared_rows);
    /* Components of loads that are not unique, by joint and loop; none where they are zero in all joints. */
    kmp_text text = {0};
    if (check->diagnosis.loads.loaded)
        (void)kmp_put_shared_loads(&text, check->system->model, &check->diagnosis.loads);
    kmp_json_string(json, "loads_not_unique", text.s ? text.s : "");
    kmp_text_free_part(json->text, &text);
    kmp_json_array(json, "repairs");
    for (int k = 0; k < d->repair_count; k++) {
        kmp_json_put(json, "{ closure %s may_lose %d of %d", kmp_name_of_closure(check->system, d->repairs[k].closure),
                     d->repairs[k].count, d->repairs[k].of);
        json_rows(json, "rows", check, d->repairs[k].count, d->repairs[k].rows);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void json_assembled(kmp_json *json, const kempe_check *check)
{
    kmp_json_put(json, "nbody %d nq %d nh %d", check->body_count, check->part.n, check->part.m);
    const kmp_partition *part = &check->part;
    kmp_json_put(json, "rank %d dof %d driven %d undetermined %s", part->r, part->p, check->driven,
                 check->undetermined);
    json_rows(json, "redundant", check, part->m - part->r, part->redundant);
    kmp_print_names(json, "u", check->system, kmp_name_of_coordinate, part->p, part->u);
    kmp_print_names(json, "v", check->system, kmp_name_of_coordinate, part->r, part->v);
    kmp_json_put(json, "cond_Jv %g max_B %g exchanges %d", check->condition, part->max_b, part->exchanges);
    kmp_json_numbers(json, "pivots", part->m < part->n ? part->m : part->n, part->pivots);
    const kmp_diagnosis *d = &check->diagnosis;
    kmp_json_array(json, "blocks");
    for (int b = 0; b < d->block_count; b++)
        kmp_print_names(json, NULL, check->system, kmp_name_of_coordinate, d->blocks[b].size, d->blocks[b].columns);
    kmp_json_put(json, "] block_closures [");
    for (int b = 0; b < d->block_count; b++)
        kmp_print_names(json, NULL, check->system, kmp_name_of_closure, d->blocks[b].closure_count,
                        d->blocks[b].closures);
    kmp_json_end(json);
    kmp_json_whole(json, "loops", check->loop_count);
    static const char *const words[] = {NULL, "real", "branches", "shaky", "conditions"};
    kmp_json_put(json, "mobility { dof %d driven %d counted %d generic_dof %g declared_rows %d margin %g",
                 check->part.p, check->driven, check->part.n - check->part.m,
                 d->moved || check->part.p == 0 ? (double)(check->part.n - d->generic_rank) : (double)NAN, d->declared,
                 d->margin);
    json_sentence(json, "explanation", check, kmp_check_mobility);
    kmp_json_put(json, "second_order %s branches %g }", words[d->second],
                 d->second == KMP_SECOND_BRANCHES ? (double)d->branches : (double)NAN);
    json_redundancy(json, check);
    kmp_json_array(json, "alternatives");
    for (int k = 0; k < check->diagnosis.alternative_count; k++) {
        const kmp_alternative *a = &check->diagnosis.alternatives[k];
        kmp_json_put(json, "{ coordinate %s instead_of %s max_B %g }", motion_name(check, a->coordinate),
                     motion_name(check, a->instead), a->max_b);
    }
    kmp_json_end(json);
    const kmp_limits *l = &check->diagnosis.limits;
    kmp_json_put(json, "limits { walked %d cycle %d reason %s range {", l->walked, l->cycle,
                 l->walked ? l->ended : l->why_not);
    for (int k = 0; l->walked && k < check->system->n; k++) {
        const kmp_coordinate_range *range = &l->range[k];
        kmp_json_put(json, "%s { low %g high %g turns %d low_dead_centre %d high_dead_centre %d }",
                     motion_name(check, k), range->low, range->high, range->turns, range->low_dead, range->high_dead);
    }
    kmp_json_put(json, "} met [");
    for (int i = 0; i < l->limit_position_count; i++) {
        const kmp_limit_position *mark = &l->limit_position[i];
        kmp_json_put(json, "{ what %s coordinate %s margin %g", mark->coordinate >= 0 ? "dead centre" : "change point",
                     motion_name(check, mark->coordinate), mark->margin);
        kmp_print_entries(json, "q", check->system, KMP_QUANTITY_Q, mark->q);
        kmp_json_end(json);
    }
    kmp_json_put(json, "] }");
}

/* -- failed assembly --------------------------------------------------------------------------------- */

static void json_obstacle(kmp_json *json, const kempe_check *check)
{
    const kempe_assembly *a = check->assembly;
    kmp_json_put(json, "nbody %d nq %d nh %d loops %d", check->body_count, check->system->n, check->system->m,
                 check->loop_count);
    kmp_json_put(json, "rank %g dof %g cond_Jv %g max_B %g redundant [ ] u [ ] v [ ] blocks [ ] gap %g turn %g", NAN,
                 NAN, NAN, NAN, a->gap, a->turn);
    kmp_print_names(json, "culprits", check->system, kmp_name_of_closure, a->culprit_count, a->culprits);
    const kmp_obstacle *o = &check->obstacle;
    kmp_json_array(json, "releases");
    for (int k = 0; k < o->release_count; k++) {
        const kmp_release *release = &o->releases[k];
        kmp_json_put(json, "{ coordinate %s closes %d to %g }", motion_name(check, release->coordinate),
                     release->closes, release->closes ? release->to : NAN);
    }
    kmp_json_put(json, "] too_short [");
    for (int k = 0; k < check->obstacle.reach_count; k++) {
        const kmp_short_links *reach = &check->obstacle.reaches[k];
        kmp_json_put(json, "{ closure %s longest %g others %g }", kmp_name_of_closure(check->system, reach->closure),
                     reach->longest, reach->others);
    }
    kmp_json_end(json);
}

void kmp_check_json(kmp_text *text, const void *result)
{
    const kempe_check *check = result;
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, check->system, kmp_status_word(check->status), check->reason, check->system->build_s,
                   check->warnings);
    json_sentence(&j, "verdict", check, kmp_check_verdict);
    if (check->assembled)
        json_assembled(&j, check);
    else
        json_obstacle(&j, check);
    const kempe_model *model = check->system->model;
    kmp_json_array(&j, "cuts");
    for (int k = 0; k < model->cut_count; k++) {
        const kmp_cut *cut = &model->cuts[k];
        kmp_json_object(&j, NULL);
        kmp_model_json_cut(&j, cut);
        kmp_json_end(&j);
    }
    kmp_json_end(&j);
    /* Bodies whose mass follows from their shapes, where there are any. */
    int count = 0;
    for (int b = 1; b < model->body_count; b++) {
        if (!model->bodies[b].by_shape)
            continue;
        if (count++ == 0)
            kmp_json_array(&j, "mass_by_shapes");
        kmp_json_put(&j, "{ body %s", model->bodies[b].name);
        kmp_model_json_mass(&j, &model->bodies[b]);
        kmp_json_end(&j);
    }
    if (count > 0)
        kmp_json_end(&j);
    kmp_print_unused_json(&j, check->system->model);
    kmp_json_end(&j);
}
