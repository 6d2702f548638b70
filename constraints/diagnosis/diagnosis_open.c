/* SPDX-License-Identifier: BSD-3-Clause */
/* Reasons of a failed assembly. Held coordinates are released in trials, one by one and then all. If every joint of a
 * loop turns, its links are a polygon, which closes only if none is longer than all others together. */
#include "constraints/diagnosis/diagnosis_open.h"
#include "constraints/closing/loop_polygon.h"
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/kinds/kind_parts.h"
#include "model/data/model.h"
#include <kempe/check.h>
#include <math.h>
#include <string.h>

enum { PUSHES = 4 };

/* -- held coordinates -------------------------------------------------------------------------------- */

static bool try_release(const kempe_system *s, const double *q, const bool *hold, int coordinate, kmp_release *release)
{
    kempe_assembly *a = NULL;
    kmp_guess guess = {q, hold, PUSHES, false, 0};
    if (kmp_assemble_from(s, &guess, &a) != KEMPE_OK)
        return false;
    *release = (kmp_release){coordinate, a->closed, coordinate < 0 ? 0 : a->q[coordinate]};
    kempe_assembly_free(a);
    return true;
}

static bool try_releases(kmp_obstacle *o, const kempe_system *s, kmp_arena *arena)
{
    const kmp_start *start = &s->model->start;
    double *q = KMP_ARENA_NEW(arena, double, s->n);
    bool *hold = KMP_ARENA_NEW(arena, bool, s->n), some = false;
    o->releases = KMP_ARENA_NEW(arena, kmp_release, s->n + 1);
    if (!q || !hold || !o->releases)
        return false;
    for (int k = 0; k < s->n; k++) {
        q[k] = start->q[k].value;
        hold[k] = start->hold[k];
    }
    for (int k = 0; k < s->n; k++) {
        if (!start->hold[k])
            continue;
        hold[k] = false;
        if (!try_release(s, q, hold, k, &o->releases[o->release_count]))
            return false;
        some = some || o->releases[o->release_count].closes;
        o->release_count++;
        hold[k] = true;
    }
    if (some || o->release_count < 2)
        return true;
    memset(hold, 0, (size_t)s->n * sizeof *hold);
    return try_release(s, q, hold, -1, &o->releases[o->release_count++]);
}

/* -- lengths ----------------------------------------------------------------------------------------- */

static const char *point_name(const kempe_model *model, int point)
{
    return point < 0 ? "its joint" : model->points[point].name;
}

static bool too_short(const kempe_model *model, int closure, kmp_short_links *reach)
{
    const kmp_closure *c = &model->closures[closure];
    const kmp_closure_parts *kind = kmp_closure_parts_of(c->kind);
    const kmp_part *part = kind ? kind->force : NULL;
    bool rod = part == &kmp_part_rod;
    if (!(rod || part == &kmp_part_ball) || c->function) /* a ball makes its points coincide */
        return false;
    kmp_loop_polygon p = kmp_loop_polygon_of(model, c);
    if (p.slides)
        return false;
    double length = rod ? c->number.value : 0, others = p.sum - p.longest + length;
    if (length > p.longest && length > p.sum) { /* the rod is the longest side */
        *reach = (kmp_short_links){closure, length, p.sum, NULL, NULL, NULL};
        return true;
    }
    *reach = (kmp_short_links){
        closure, p.longest, others, point_name(model, p.from), point_name(model, p.to), model->bodies[p.body].name};
    return p.longest > others * (1 + 1e-12);
}

kempe_status kmp_obstacle_find(kmp_obstacle *obstacle, const kempe_assembly *assembly, kmp_arena *arena)
{
    const kempe_system *s = assembly->system;
    obstacle->reaches = KMP_ARENA_NEW(arena, kmp_short_links, s->model->closure_count);
    KMP_TRY(kmp_made(s->context, obstacle->reaches && try_releases(obstacle, s, arena)));
    for (int c = 0; c < s->model->closure_count; c++)
        obstacle->reach_count += too_short(s->model, c, &obstacle->reaches[obstacle->reach_count]);
    return KEMPE_OK;
}
