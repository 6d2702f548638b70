/* SPDX-License-Identifier: BSD-3-Clause */
/* Dry friction that sticks at an equilibrium. */
#include "base/memory.h"
#include "studies/equilibrium/balances.h"
#include <math.h>
#include <string.h>

static const char *unit_of(const kempe_model *model, const kmp_friction_view *view)
{
    const kmp_force *element = view->element;
    bool turns =
        element->motion >= 0 ? model->motions[element->motion].rotation : model->closures[element->closure].power == 0;
    return turns ? "N m" : "N";
}

/* Names the elements at rest, all of them or those that need more than they have. Their number. */
static int name(const kempe_model *model, const kmp_friction_state *f, bool all, kmp_text *text)
{
    int count = 0;
    for (int i = 0; i < f->count; i++) {
        const kmp_friction_view *view = &f->view[i];
        bool takes_part = !view->contact && !view->off;
        bool named = takes_part && (all ? view->rate == 0 : view->needs > view->largest);
        if (named)
            kmp_text_printf(text, "%s'%s'", count++ ? ", " : "", view->element->name);
        if (named && !all)
            kmp_text_printf(text, " needs %.6g of at most %.6g %s", view->needs, view->largest, unit_of(model, view));
    }
    return count;
}

/* Warns of friction at rest that has no force. */
static void tell_left_out(const kempe_model *model, const kmp_friction_state *f, kempe_context *context)
{
    kmp_text names = {0};
    int count = name(model, f, true, &names);
    if (count > 0)
        kmp_log(
            context, KEMPE_LOG_WARNING,
            "friction %s has no force at rest here: equilibrium and stability are those without it; with --stick it "
            "keeps its place",
            names.s);
    kmp_text_free(&names);
}

/* Friction sticks only in this computation. */
static void doubt_rest(const kempe_model *model, const kmp_friction_state *f, kempe_context *context)
{
    kmp_text names = {0};
    (void)name(model, f, false, &names);
    kmp_doubt(
        context,
        "friction does not hold this state, which is no equilibrium: %s; start where it holds, or compute without "
        "--stick",
        names.s ? names.s : "it has no level");
    kmp_text_free(&names);
}

/* Forces of the elements that stick, also as multipliers of their rows. */
static kempe_status take_forces(kempe_equilibrium *e, const kmp_linear *l, kmp_balance *b)
{
    const kempe_system *s = e->system;
    kmp_friction_state *f = e->friction;
    KMP_TRY(kmp_friction_state_load(f, l->t, l->q));
    b->friction = KMP_ARENA_NEW(&e->arena, kmp_friction_view, f->count);
    KMP_TRY(kmp_made(s->context, b->friction));
    for (int i = 0; i < f->count; i++)
        if (!f->view[i].contact)
            b->friction[b->friction_count++] = f->view[i];
    memcpy(b->lambda, f->lambda, (size_t)s->m * sizeof *b->lambda);
    KMP_TRY(kmp_balance_add_loads(e, l, f->lambda, b));
    for (int r = 0; r < s->m; r++)
        for (int i = 0; i < f->count; i++)
            if (!f->view[i].contact && s->rows[r].closure == f->view[i].element->closure)
                b->lambda[r] = f->view[i].force;
    if (f->part > 1) {
        b->stability.word = KMP_NOT_HELD;
        doubt_rest(s->model, f, s->context);
    }
    return KEMPE_OK;
}

static bool is_moving(const kmp_linear *l)
{
    for (int k = 0; k < kmp_model_coordinates(l->system->model); k++)
        if (l->qd[k] != 0)
            return true;
    return false;
}

kempe_status kmp_balance_add_friction(kempe_equilibrium *equilibrium, kmp_linear *linear, kmp_balance *balance)
{
    kempe_equilibrium *e = equilibrium;
    kmp_friction_state *f = e->friction;
    if (!f)
        return KEMPE_OK;
    kmp_friction_state_look(f, linear->t, linear->q, linear->qd);
    if (!e->stick && e->count == 0)
        tell_left_out(e->system->model, f, e->system->context);
    if (is_moving(linear))
        return KEMPE_OK;
    f->part = 0;
    KMP_TRY(e->stick ? take_forces(e, linear, balance) : KEMPE_OK);
    balance->friction_part = f->part;
    if (f->part > 1 || e->system->chart_count > 0)
        return KEMPE_OK;
    return kmp_rest_sets_find(linear, f, linear->t, linear->q, &e->arena, &balance->set_count, &balance->set);
}
