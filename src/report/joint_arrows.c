/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces are 16-bit integers, parts of the largest component. The more joints have arrows, the fewer instants there
 * are. */
#include "report/joint_arrows.h"
#include "analyses/equilibrium/balances.h"
#include "analyses/inverse/inverse_study.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/data/closure.h"
#include "model/data/model.h"
#include "report/base64.h"
#include <math.h>
#include <string.h>

/* Joints with arrows; numbers of all of them, which are some 60 kB of a page. */
enum { MOST_JOINTS = 40, MOST_NUMBERS = 24000 };

KMP_CLEARS(kmp_joint_arrows, arrows, kmp_reactions_free(&arrows->made), kmp_arena_free(&arrows->arena))

/* -- instants ------------------------------------------------------------------------------------------- */

/* Rows between two instants. */
static int choose_stride(int rows, int joints)
{
    const int most = MOST_NUMBERS / (3 * (joints > MOST_JOINTS ? MOST_JOINTS : joints > 1 ? joints : 1));
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

kempe_status kmp_joint_arrows_of_run(kmp_joint_arrows *arrows, const kempe_system *system, const kmp_samples *rows,
                                     bool least_norm, bool locked)
{
    const kempe_model *model = system->model;
    const int count = rows->rows - (locked && rows->rows > 2),
              stride = choose_stride(count, model->body_count - 1 + model->closure_count);
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
    kmp_samples_free(&some);
    arrows->of = &arrows->made;
    arrows->load = arrows->made.kept;
    return status;
}

kempe_status kmp_joint_arrows_of_inverse(kmp_joint_arrows *arrows, const kempe_inverse *r)
{
    const int stride = choose_stride(r->rows, r->loops + r->joints), loads = r->reactions.loads;
    arrows->count = count_instants(r->rows, stride);
    arrows->x = KMP_ARENA_NEW(&arrows->arena, double, arrows->count + 1);
    arrows->load = KMP_ARENA_NEW(&arrows->arena, double, (size_t)arrows->count *(size_t)loads + 1);
    KMP_TRY(kmp_made(r->system->context, !arrows->arena.failed));
    for (int k = 0; k < arrows->count; k++) {
        const int row = row_of(k, r->rows, stride);
        double *load = arrows->load + (ptrdiff_t)k * loads;
        arrows->x[k] = r->t[row];
        memset(load, 0, (size_t)loads * sizeof *load);
        for (int l = 0; l < r->loops + r->joints; l++) {
            const int place = l < r->loops ? r->loop[l] : r->system->model->closure_count + l - r->loops;
            memcpy(load + KMP_LOAD_VALUES * place, kmp_inverse_part(r, row, r->at.force + 3 * l), 3 * sizeof *load);
        }
    }
    arrows->of = &r->reactions;
    return KEMPE_OK;
}

/* Their numbers are from 1 on. */
kempe_status kmp_joint_arrows_of_equilibria(kmp_joint_arrows *arrows, const kempe_equilibrium *e)
{
    if (e->count == 0)
        return KEMPE_OK;
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
    return KEMPE_OK;
}

/* -- joints --------------------------------------------------------------------------------------------- */

/* The joints with the largest forces that are drawn: the force on the second body acts at its point. */
typedef struct chosen {
    int count, left_out;
    const kmp_reaction *of[MOST_JOINTS + 1];
    kmp_drawn_point at[MOST_JOINTS + 1];
} chosen;

static kmp_drawn_point place_of(const kmp_drawing *drawing, const kempe_model *model, const kmp_reaction *of)
{
    const int point = of->closure >= 0 ? model->closures[of->closure].point[1] : model->bodies[of->body].to;
    if (point >= 0)
        return kmp_drawing_point(drawing, model, point);
    return (kmp_drawn_point){.body = of->body < drawing->body_count ? of->body : -1};
}

static void choose(chosen *c, const kmp_joint_arrows *arrows, const kmp_drawing *drawing)
{
    const kmp_reactions *r = arrows->of;
    for (const kmp_reaction *of = r->of; of < r->of + r->count; of++) {
        const bool is_force =
            of->place >= 0 && of->has[0] && !of->effort && (of->body >= 0 || of->closure >= 0); /* in space */
        if (!is_force || !(of->peak[0].size > 0))
            continue;
        const kmp_drawn_point at = place_of(drawing, r->system->model, of);
        int k = at.body >= 0 ? c->count : 0;
        for (; k > 0 && of->peak[0].size > c->of[k - 1]->peak[0].size; k--) {
            c->of[k] = c->of[k - 1];
            c->at[k] = c->at[k - 1];
        }
        c->left_out += at.body < 0 || c->count == MOST_JOINTS;
        if (at.body < 0)
            continue;
        c->of[k] = of;
        c->at[k] = at;
        c->count += c->count < MOST_JOINTS;
    }
}

static void put_forces(kmp_json *json, const kmp_joint_arrows *arrows, const chosen *c, double factor)
{
    const ptrdiff_t numbers = 3 * (ptrdiff_t)c->count * arrows->count;
    double *force = KMP_NEW(double, numbers), most = 0;
    int16_t *part = KMP_NEW(int16_t, numbers);
    json->text->failed = json->text->failed || !force || !part;
    for (ptrdiff_t k = 0; force && k < numbers; k++) {
        const double *load = arrows->load + k / (3 * c->count) * arrows->of->loads;
        force[k] = load[KMP_LOAD_VALUES * c->of[k / 3 % c->count]->place + k % 3];
        force[k] = isfinite(force[k]) ? factor * force[k] : 0;
        most = fmax(most, fabs(force[k]));
    }
    for (ptrdiff_t k = 0; force && part && k < numbers; k++)
        part[k] = (int16_t)lround(most > 0 ? INT16_MAX * force[k] / most : 0);
    kmp_json_rounded(json, "most", most, 9);
    if (force && part)
        kmp_json_shorts(json, "parts", (size_t)numbers, part);
    kmp_free(force);
    kmp_free(part);
}

void kmp_joint_arrows_put(kmp_json *json, const kmp_joint_arrows *arrows, const kmp_drawing *drawing)
{
    chosen c = {0};
    if (arrows && arrows->of && arrows->count > 0)
        choose(&c, arrows, drawing);
    if (c.count == 0) {
        kmp_json_string(json, "arrows", NULL);
        return;
    }
    const kmp_shown as = kmp_shown_as(arrows->of->system->context, "N");
    kmp_json_put(json, "arrows { unit %s left_out %d joints [", as.unit, c.left_out);
    for (int k = 0; k < c.count; k++) {
        kmp_json_put(json, "{ name %s body %d", c.of[k]->name, c.at[k].body);
        kmp_json_rounded_numbers(json, "at", 3, c.at[k].at, 7);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    kmp_json_floats(json, "x", (size_t)arrows->count, arrows->x);
    put_forces(json, arrows, &c, as.factor);
    kmp_json_end(json);
}
