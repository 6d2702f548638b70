/* SPDX-License-Identifier: BSD-3-Clause */
/* Reasons of a failed assembly. Held coordinates are released in trials, one by one and then all. If every joint of a
 * loop turns, its links are a polygon, which closes only if none is longer than all others together. */
#include "constraints/diagnosis/diagnosis.h"
#include "constraints/kinds/kind_parts.h"
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

/* The polygon of one loop: its longest side and the sum of all sides. */
typedef struct polygon {
    const kempe_model *model;
    double longest, sum;
    bool slides;        /* a joint of the loop slides */
    int body, from, to; /* of the longest side: points, -1 the origin */
} polygon;

static void position(const kempe_model *model, int point, double at[3])
{
    for (int k = 0; k < 3; k++)
        at[k] = point < 0 ? 0 : model->points[point].at[k].value;
}

static void add_side(polygon *p, int body, int from, int to)
{
    double a[3], b[3];
    position(p->model, from, a);
    position(p->model, to, b);
    double length = hypot(hypot(b[0] - a[0], b[1] - a[1]), b[2] - a[2]);
    p->sum += length;
    if (length > p->longest) {
        p->longest = length;
        p->body = body;
        p->from = from;
        p->to = to;
    }
}

static bool turns_only(const kempe_model *model, int body)
{
    for (int k = 0; k < model->bodies[body].motion_count; k++)
        if (!model->motions[model->bodies[body].first_motion + k].rotation)
            return false;
    return true;
}

/* Adds the sides on the bodies from point `at` of `body` up to `top`. *at is then a point of `top`. */
static void climb(polygon *p, int body, int top, int *at)
{
    for (; body != top; body = p->model->bodies[body].parent) {
        p->slides = p->slides || !turns_only(p->model, body);
        add_side(p, body, p->model->bodies[body].to, *at);
        *at = p->model->bodies[body].at;
    }
}

static polygon polygon_of(const kempe_model *model, const kmp_closure *c)
{
    polygon p = {.model = model, .from = -1, .to = -1};
    int at = c->point[0], bt = c->point[1];
    int a = model->points[at].body, b = model->points[bt].body, top = kmp_model_common_body(model, a, b);
    climb(&p, a, top, &at);
    climb(&p, b, top, &bt);
    add_side(&p, top, at, bt);
    return p;
}

double kmp_loop_longest_side(const kempe_model *model, int closure)
{
    const kmp_closure *c = &model->closures[closure];
    return c->point[0] >= 0 && c->point[1] >= 0 ? polygon_of(model, c).longest : 0;
}

static const char *point_name(const kempe_model *model, int point)
{
    return point < 0 ? "its joint" : model->points[point].name;
}

static bool too_short(const kempe_model *model, int closure, kmp_short_links *reach)
{
    const kmp_closure *c = &model->closures[closure];
    const kmp_closure_kind *kind = kmp_closure_kind_find(c->kind);
    const kmp_part *part = kind ? kind->force : NULL;
    bool rod = part == &kmp_part_rod;
    if (!(rod || part == &kmp_part_ball) || c->function) /* a ball makes its points coincide */
        return false;
    polygon p = polygon_of(model, c);
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
