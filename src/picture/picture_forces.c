/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces are 16-bit integers, parts of the largest component, and so are places that move in their bodies. The more
 * arrows there are, the fewer are the instants. Of a contact with outlines the two largest forces have arrows: these
 * are two places, of which each may be of any pair of circle and piece. */
#include "picture/picture_forces.h"
#include "analyses/equilibrium/balances.h"
#include "analyses/inverse/inverse_study.h"
#include "base/base64.h"
#include "base/context.h"
#include "base/memory.h"
#include "dynamics/kinematics/gear_mesh.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/pose.h"
#include "picture/placed_forces.h"
#include <math.h>
#include <string.h>

/* Arrows; numbers of all of them, which are some 60 kB of a page; arrows of a contact with outlines. */
enum { MOST_ARROWS = 40, MOST_NUMBERS = 24000, OUTLINE_ARROWS = 2 };

KMP_CLEARS(kmp_picture_forces, arrows, kmp_reactions_free(&arrows->made), kmp_arena_free(&arrows->arena))

/* -- instants ------------------------------------------------------------------------------------------- */

/* Rows between two instants. An arrow whose place moves counts twice. */
static int choose_stride(int rows, int joints, int moving)
{
    const int arrows = joints + 2 * moving;
    const int most = MOST_NUMBERS / (3 * (arrows > MOST_ARROWS ? MOST_ARROWS : arrows > 1 ? arrows : 1));
    return rows > most ? (rows + most - 2) / (most - 1) : 1;
}

static int count_instants(int rows, int stride)
{
    return rows > 0 ? (rows + stride - 2) / stride + 1 : 0;
}

static int row_of(int instant, int rows, int stride)
{
    return instant * stride < rows ? instant * stride : rows - 1;
}

/* -- forces with places -------------------------------------------------------------------------------- */

/* The number of arrows of a force. */
static int arrows_of(const kmp_placed_force *placed)
{
    return placed->pairs > 1 ? OUTLINE_ARROWS : 1;
}

/* Lists each force as often as it has arrows. */
static kempe_status list_placed(kmp_picture_forces *arrows, const kempe_system *system)
{
    const int count = kmp_placed_forces(system->model, NULL);
    arrows->placed = KMP_ARENA_NEW(&arrows->arena, kmp_placed_force, OUTLINE_ARROWS * count + 1);
    kmp_placed_force *one = KMP_ARENA_NEW(&arrows->arena, kmp_placed_force, count + 1);
    KMP_TRY(kmp_made(system->context, one && arrows->placed));
    (void)kmp_placed_forces(system->model, one);
    for (int k = 0; k < count; k++)
        for (int i = 0; i < arrows_of(&one[k]); i++)
            arrows->placed[arrows->placed_count++] = one[k];
    return KEMPE_OK;
}

/* Expressions of all pairs of the forces. */
static kempe_status derive_placed(const kmp_picture_forces *arrows, const kempe_system *system, kmp_formulas *formulas)
{
    const kmp_derivation_request request = {.sets = KMP_SET_REACTION, .plain = true, .keep_modes = true};
    kmp_equations eq;
    kmp_arena room = {0};
    int pairs = 0;
    for (int k = 0; k < arrows->placed_count; k += arrows_of(&arrows->placed[k]))
        pairs += arrows->placed[k].pairs;
    kmp_ref *out = KMP_ARENA_NEW(&room, kmp_ref, KMP_PLACED_VALUES * pairs + 1);
    kempe_status status = kmp_made(system->context, out);
    if (status == KEMPE_OK)
        status = kmp_equations_derive_once(&eq, system->model, &request);
    if (status == KEMPE_OK) {
        for (int k = 0, at = 0; k < arrows->placed_count; k += arrows_of(&arrows->placed[k])) {
            kmp_placed_force_find(&eq.tree, &arrows->placed[k], out + (ptrdiff_t)KMP_PLACED_VALUES * at);
            at += arrows->placed[k].pairs;
        }
        status = kmp_made(system->context, kmp_formulas_init(formulas, eq.graph, KMP_PLACED_VALUES * pairs, out,
                                                             kmp_backend_find("tape"), system->parameters));
        kmp_equations_free(&eq);
    }
    kmp_arena_free(&room);
    return status;
}

static double size_of(const double *v)
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* The largest forces of pairs, one for each arrow; places and forces that are not finite are none. */
static void take_pairs(const kmp_placed_force *placed, const double *value, const kmp_pose *poses, double *acting)
{
    const int most = arrows_of(placed);
    memset(acting, 0, (size_t)(KMP_PLACED_VALUES * most) * sizeof *acting);
    for (int pair = 0; pair < placed->pairs; pair++, value += KMP_PLACED_VALUES) {
        double size = size_of(value + 3);
        int k = most;
        if (!isfinite(size) || !isfinite(size_of(value)))
            continue;
        while (k > 0 && size > size_of(acting + (ptrdiff_t)KMP_PLACED_VALUES * (k - 1) + 3))
            k--;
        if (k == most)
            continue;
        double *to = acting + (ptrdiff_t)KMP_PLACED_VALUES * k;
        memmove(to + KMP_PLACED_VALUES, to, (size_t)(KMP_PLACED_VALUES * (most - 1 - k)) * sizeof *to);
        for (int i = 0; i < KMP_PLACED_VALUES; i++)
            to[i] = value[i] - (i < 3 ? poses[placed->body].p[i] : 0);
    }
}

/* All forces with places at the instants of the arrows. */
static kempe_status act(kmp_picture_forces *arrows, const kempe_system *system, const kmp_samples *rows)
{
    const int width = KMP_PLACED_VALUES * arrows->placed_count;
    kmp_formulas formulas = {0};
    kmp_present_inputs inputs;
    kmp_arena room = {0};
    kmp_pose *poses = KMP_ARENA_NEW(&room, kmp_pose, kmp_model_body_count(system->model));
    arrows->acting = KMP_ARENA_NEW(&arrows->arena, double, (ptrdiff_t)rows->rows *width + 1);
    kempe_status status =
        kmp_made(system->context, poses && arrows->acting && kmp_present_inputs_init(&inputs, &room, system->model));
    if (status == KEMPE_OK)
        status = derive_placed(arrows, system, &formulas);
    for (int row = 0; status == KEMPE_OK && row < rows->rows; row++) {
        inputs.before = true;
        const kmp_instant at = {.t = kmp_samples_instant(rows, row),
                                .q = kmp_samples_get(rows, KMP_QUANTITY_Q, row),
                                .qd = kmp_samples_get(rows, KMP_QUANTITY_QD, row),
                                .qdd = kmp_samples_get(rows, KMP_QUANTITY_QDD, row),
                                .lambda = kmp_samples_get(rows, KMP_QUANTITY_LAMBDA, row),
                                .inputs = &inputs};
        const double *value = kmp_formulas_at(&formulas, &at);
        kmp_pose_all(system->model, at.q, poses);
        for (int k = 0; k < arrows->placed_count; k += arrows_of(&arrows->placed[k])) {
            take_pairs(&arrows->placed[k], value, poses,
                       arrows->acting + (ptrdiff_t)row * width + (ptrdiff_t)KMP_PLACED_VALUES * k);
            value += (ptrdiff_t)KMP_PLACED_VALUES * arrows->placed[k].pairs;
        }
    }
    kmp_formulas_free(&formulas);
    kmp_arena_free(&room);
    return status;
}

/* -- results ------------------------------------------------------------------------------------------- */

kempe_status kmp_picture_forces_of_run(kmp_picture_forces *arrows, const kempe_system *system, const kmp_samples *rows,
                                       bool least_norm, bool locked)
{
    const kempe_model *model = system->model;
    KMP_TRY(list_placed(arrows, system));
    const int count = rows->rows - (locked && rows->rows > 2),
              stride = choose_stride(count, kmp_model_body_count(model) - 1 + kmp_model_closure_count(model),
                                     arrows->placed_count);
    kmp_samples some;
    kmp_samples_init(&some, system->n, system->m);
    kempe_status status = KEMPE_OK;
    arrows->count = count_instants(count, stride);
    arrows->x = KMP_ARENA_NEW(&arrows->arena, double, arrows->count + 1);
    bool made = arrows->x;
    for (int k = 0; made && k < arrows->count; k++) {
        const int row = row_of(k, count, stride);
        arrows->x[k] = kmp_samples_time(rows, row);
        made =
            kmp_samples_add(&some, kmp_samples_instant(rows, row), kmp_samples_get(rows, KMP_QUANTITY_Q, row),
                            kmp_samples_get(rows, KMP_QUANTITY_QD, row), kmp_samples_get(rows, KMP_QUANTITY_QDD, row),
                            kmp_samples_get(rows, KMP_QUANTITY_LAMBDA, row), 0) == 0;
    }
    status = kmp_made(system->context, made);
    if (status == KEMPE_OK)
        status = kmp_reactions_keep_rows(&arrows->made, system, &some, least_norm);
    if (status == KEMPE_OK && arrows->placed_count > 0)
        status = act(arrows, system, &some);
    kmp_samples_free(&some);
    arrows->of = &arrows->made;
    arrows->load = arrows->made.kept;
    return status;
}

kempe_status kmp_picture_forces_of_inverse(kmp_picture_forces *arrows, const kempe_inverse *r)
{
    const int stride = choose_stride(r->rows, kmp_inverse_load_count(r), 0), loads = r->reactions.loads;
    arrows->count = count_instants(r->rows, stride);
    arrows->x = KMP_ARENA_NEW(&arrows->arena, double, arrows->count + 1);
    arrows->load = KMP_ARENA_NEW(&arrows->arena, double, (size_t)arrows->count *(size_t)loads + 1);
    KMP_TRY(kmp_made(r->system->context, !arrows->arena.failed));
    for (int k = 0; k < arrows->count; k++) {
        const int row = row_of(k, r->rows, stride);
        double *load = arrows->load + (ptrdiff_t)k * loads;
        arrows->x[k] = r->t[row];
        memset(load, 0, (size_t)loads * sizeof *load);
        for (int l = 0; l < kmp_inverse_load_count(r); l++)
            memcpy(load + KMP_LOAD_VALUES * kmp_inverse_load_place(r, l), kmp_inverse_part(r, row, r->at.force + 3 * l),
                   3 * sizeof *load);
    }
    arrows->of = &r->reactions;
    return KEMPE_OK;
}

/* The states of equilibria at t = 0, whose forces with places act. */
static kempe_status act_at_rest(kmp_picture_forces *arrows, const kempe_equilibrium *e)
{
    const kempe_system *system = e->system;
    kmp_samples rows;
    kmp_samples_init(&rows, system->n, system->m);
    double *zero = KMP_NEW(double, system->n + 1);
    bool made = zero;
    for (int k = 0; made && k < e->count; k++)
        made = kmp_samples_add(&rows, 0, e->balance[k].q, e->balance[k].qd, zero, e->balance[k].lambda, 0) == 0;
    kempe_status status = kmp_made(system->context, made);
    if (status == KEMPE_OK)
        status = act(arrows, system, &rows);
    kmp_free(zero);
    kmp_samples_free(&rows);
    return status;
}

/* Their numbers are from 1 on. */
kempe_status kmp_picture_forces_of_equilibria(kmp_picture_forces *arrows, const kempe_equilibrium *e)
{
    if (e->count == 0)
        return KEMPE_OK;
    KMP_TRY(list_placed(arrows, e->system));
    KMP_TRY(kmp_reactions_init(&arrows->made, e->system, &e->loads, true));
    KMP_TRY(kmp_reactions_keep(&arrows->made, e->count));
    arrows->x = KMP_ARENA_NEW(&arrows->arena, double, e->count);
    KMP_TRY(kmp_made(e->system->context, arrows->x));
    for (int k = 0; k < e->count; k++) {
        arrows->x[k] = k + 1;
        kmp_reactions_add(&arrows->made, arrows->x[k], e->balance[k].reaction);
    }
    arrows->of = &arrows->made;
    arrows->load = arrows->made.kept;
    arrows->count = e->count;
    return arrows->placed_count > 0 ? act_at_rest(arrows, e) : KEMPE_OK;
}

/* -- arrows -------------------------------------------------------------------------------------------- */

/* An arrow: the force on the body of its colour, at a point that rests in a body, or at a place that moves. */
typedef struct arrow {
    const char *name, *kind, *label;
    const kmp_reaction *of; /* NULL: of this force with a place */
    int placed;
    double peak, sense; /* sense -1: the opposite of the reaction */
    int body;
    kmp_drawn_point at;
} arrow;

/* The largest arrows that are drawn, in order. */
typedef struct chosen {
    int count, left_out;
    arrow arrow[MOST_ARROWS + 1];
} chosen;

static void offer(chosen *c, arrow a)
{
    if (!(a.peak > 0))
        return;
    c->left_out += a.at.body < 0 || c->count == MOST_ARROWS;
    if (a.at.body < 0)
        return;
    int k = c->count;
    for (; k > 0 && a.peak > c->arrow[k - 1].peak; k--)
        c->arrow[k] = c->arrow[k - 1];
    c->arrow[k] = a;
    c->count += c->count < MOST_ARROWS;
}

static int drawn(const kmp_drawing *drawing, int body)
{
    return body < drawing->body_count ? body : -1;
}

/* The force on the second body of a joint acts at its point. */
static arrow arrow_of_joint(const kmp_drawing *drawing, const kempe_model *model, const kmp_reaction *of)
{
    arrow a = {.name = of->name, .kind = "joints", .label = "", .of = of, .peak = of->peak[0].size, .sense = 1};
    const int point =
        of->closure >= 0 ? kmp_model_closure(model, of->closure)->point[1] : kmp_model_body(model, of->body)->to;
    a.at = point >= 0 ? kmp_drawing_point(drawing, model, point) : (kmp_drawn_point){.body = drawn(drawing, of->body)};
    a.body = a.at.body;
    return a;
}

/* At the pitch point, on the second wheel; on the first one where that is the ground. */
static arrow arrow_of_teeth(const kmp_drawing *drawing, const kempe_model *model, const kmp_reaction *of)
{
    const kmp_closure *closure = kmp_model_closure(model, of->closure);
    const int own = closure->gear->wheel[1] > 0;
    arrow a = {.name = of->name, .kind = "gears", .label = "", .of = of, .peak = of->peak[0].size};
    kmp_gear_numbers mesh;
    a.sense = own ? 1 : -1;
    a.body = drawn(drawing, closure->gear->wheel[own]);
    a.at.body = a.body < 0 || !kmp_gear_numbers_of(model, closure, &mesh) ? -1 : drawn(drawing, closure->gear->carrier);
    if (a.at.body >= 0)
        memcpy(a.at.at, mesh.pitch, sizeof mesh.pitch);
    return a;
}

/* Joints, closures and gears with a force in space. Cams have their own arrows. */
static void choose_joints(chosen *c, const kmp_picture_forces *arrows, const kmp_drawing *drawing)
{
    const kmp_reactions *r = arrows->of;
    const kempe_model *model = r->system->model;
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++) {
        const bool closes = of->closure >= 0;
        if (of->place < 0 || !of->has[0] || of->effort || (of->body < 0 && !closes))
            continue;
        if (closes && kmp_model_closure(model, of->closure)->gear)
            offer(c, arrow_of_teeth(drawing, model, of));
        else if (!closes || !kmp_model_closure(model, of->closure)->cam || arrows->placed_count == 0)
            offer(c, arrow_of_joint(drawing, model, of));
    }
}

static const double *acting_at(const kmp_picture_forces *arrows, int placed, int instant)
{
    return arrows->acting + (ptrdiff_t)KMP_PLACED_VALUES * (arrows->placed_count * (ptrdiff_t)instant + placed);
}

static void choose_placed(chosen *c, const kmp_picture_forces *arrows, const kmp_drawing *drawing)
{
    for (int p = 0; p < arrows->placed_count; p++) {
        const kmp_placed_force *of = &arrows->placed[p];
        arrow a = {.name = of->name, .kind = of->kind, .label = of->label, .placed = p, .sense = 1};
        for (int k = 0; k < arrows->count; k++)
            a.peak = fmax(a.peak, size_of(acting_at(arrows, p, k) + 3));
        a.body = a.at.body = drawn(drawing, of->body);
        offer(c, a);
    }
}

/* -- numbers ------------------------------------------------------------------------------------------- */

/* Numbers as parts of the largest one, which is a separate member. */
static void put_parts(kmp_json *json, const char *largest, const char *key, ptrdiff_t count, const double *value)
{
    int16_t *part = KMP_NEW(int16_t, count + 1);
    double most = 0;
    json->text->failed = json->text->failed || !part;
    for (ptrdiff_t k = 0; k < count; k++)
        most = fmax(most, fabs(value[k]));
    for (ptrdiff_t k = 0; part && k < count; k++)
        part[k] = (int16_t)lround(most > 0 ? INT16_MAX * value[k] / most : 0);
    kmp_json_rounded(json, largest, most, 9);
    if (part)
        kmp_json_shorts(json, key, (size_t)count, part);
    kmp_free(part);
}

/* The force of an arrow at an instant. */
static void force_at(const kmp_picture_forces *arrows, const arrow *a, int instant, double factor, double force[3])
{
    const double *load = a->of ? arrows->load + (ptrdiff_t)instant * arrows->of->loads + KMP_LOAD_VALUES * a->of->place
                               : acting_at(arrows, a->placed, instant) + 3;
    for (int i = 0; i < 3; i++)
        force[i] = isfinite(load[i]) ? factor * a->sense * load[i] : 0;
}

/* Forces by instants and arrows, then the places of the arrows that move, likewise. */
static void put_numbers(kmp_json *json, const kmp_picture_forces *arrows, const chosen *c, double factor)
{
    const ptrdiff_t most = 3 * (ptrdiff_t)c->count * arrows->count;
    double *force = KMP_NEW(double, most + 1), *place = KMP_NEW(double, most + 1);
    ptrdiff_t moving = 0;
    json->text->failed = json->text->failed || !force || !place;
    for (ptrdiff_t k = 0; force && place && k < most / 3; k++) {
        const arrow *a = &c->arrow[k % c->count];
        const int instant = (int)(k / c->count);
        force_at(arrows, a, instant, factor, force + 3 * k);
        if (a->of)
            continue;
        memcpy(place + moving, acting_at(arrows, a->placed, instant), 3 * sizeof *place);
        moving += 3;
    }
    if (force && place) {
        put_parts(json, "most", "parts", most, force);
        put_parts(json, "farthest", "places", moving, place);
    }
    kmp_free(force);
    kmp_free(place);
}

void kmp_picture_forces_put(kmp_json *json, const kmp_picture_forces *arrows, const kmp_drawing *drawing)
{
    chosen c = {0};
    if (arrows && arrows->of && arrows->count > 0) {
        choose_joints(&c, arrows, drawing);
        choose_placed(&c, arrows, drawing);
    }
    if (c.count == 0) {
        kmp_json_string(json, "arrows", NULL);
        return;
    }
    const kmp_shown as = kmp_shown_as(arrows->of->system->context, "N");
    kmp_json_put(json, "arrows { unit %s left_out %d rows [", as.unit, c.left_out);
    for (const arrow *a = c.arrow; a < c.arrow + c.count; a++) {
        kmp_json_put(json, "{ name %s kind %s label %s body %d on %d", a->name, a->kind, a->label, a->body, a->at.body);
        if (a->of)
            kmp_json_rounded_numbers(json, "at", 3, a->at.at, 7);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    kmp_json_floats(json, "x", (size_t)arrows->count, arrows->x);
    put_numbers(json, arrows, &c, as.factor);
    kmp_json_end(json);
}
