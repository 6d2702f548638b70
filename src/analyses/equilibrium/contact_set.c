/* SPDX-License-Identifier: BSD-3-Clause */
/* Pressing contacts by an active set: surfaces that are met become rows of J, and the contact that pulls most leaves at
 * an equilibrium. */
#include "analyses/equilibrium/contact_set.h"
#include "constraints/tolerances.h"
#include "model/read/loads.h"
#include <math.h>

enum { MOST_PASSES = 20, PASSES_OF_CONTACT = 4 };

static bool touches(const kmp_contact_set *x, int i)
{
    return x->gap[i] <= KMP_TOUCH_NEAR * x->state->view[i].size;
}

static bool overlaps(const kmp_contact_set *x, int i)
{
    return x->gap[i] < -KMP_TOUCH_NEAR * x->state->view[i].size;
}

kempe_status kmp_contact_set_begin(kmp_linear *linear, double t, const double *q, bool keeps, kmp_arena *arena,
                                   kmp_contact_set **set)
{
    kempe_context *context = linear->system->context;
    bool none;
    *set = NULL;
    if (keeps || !kmp_model_has_contacts(linear->system->model))
        return KEMPE_OK;
    kmp_contact_set *x = KMP_ARENA_NEW(arena, kmp_contact_set, 1);
    KMP_TRY(kmp_made(context, x));
    KMP_TRY(kmp_friction_state_new(linear->eval, &x->state, &none));
    *set = x;
    x->count = x->state->count;
    x->struck = -1;
    x->context = context;
    KMP_TRY(kmp_made(context, KMP_ARENA_MAKE(arena, KMP_ROOM(kmp_normal_load, x->count, &x->closed),
                                             KMP_ROOM(double, x->count, &x->gap))));
    kmp_contact_set_look(x, t, q);
    for (int i = 0; i < x->count; i++)
        x->closed[i] = touches(x, i) || kmp_friction_state_closed(x->state, i) ? KMP_PRESSED : KMP_PRESSED_NOT;
    return kmp_contact_set_press(x, t, q);
}

void kmp_contact_set_end(kmp_contact_set *set)
{
    if (set)
        kmp_friction_state_free(set->state);
}

kempe_status kmp_contact_set_press(kmp_contact_set *set, double t, const double *q)
{
    return kmp_friction_state_press(set->state, t, q, set->closed);
}

void kmp_contact_set_look(kmp_contact_set *set, double t, const double *q)
{
    kmp_friction_state_measure(set->state, t, q, set->gap);
}

int kmp_contact_set_overlap(const kmp_contact_set *set)
{
    int worst = -1;
    double most = 0;
    for (int i = 0; i < set->count; i++) {
        const kmp_friction_view *view = &set->state->view[i];
        bool held = set->closed[i] && view->word == KMP_FRICTION_WORD_STICKS;
        if (view->contact && !held && overlaps(set, i) && -set->gap[i] > most * view->size) {
            most = -set->gap[i] / view->size;
            worst = i;
        }
    }
    return worst;
}

/* The force of a closed contact, in J of its size. */
static double pushed_by(const kmp_contact_set *x, const kmp_linear *l, int i)
{
    for (int r = 0; x->closed[i] && r < l->m; r++)
        if (l->system->rows[r].closure == x->state->view[i].element->closure)
            return l->lambda[r] * x->state->view[i].size;
    return 0;
}

/* The closed contact that pulls most; -1: none. */
static int find_pull(const kmp_contact_set *x, const kmp_linear *l, double work)
{
    int worst = -1;
    for (int i = 0; i < x->count; i++)
        work = fmax(work, fabs(pushed_by(x, l, i)));
    double most = -KMP_CONTACT_NONE * work;
    for (int i = 0; i < x->count; i++) {
        double pushed = pushed_by(x, l, i);
        if (pushed < most) {
            most = pushed;
            worst = i;
        }
    }
    return worst;
}

kempe_status kmp_contact_set_exchange(kmp_contact_set *set, const kmp_linear *linear, double work, bool *agrees)
{
    kmp_contact_set_look(set, linear->t, linear->q);
    int enters = kmp_contact_set_overlap(set), leaves = enters < 0 ? find_pull(set, linear, work) : -1;
    int changed = enters >= 0 ? enters : leaves;
    *agrees = changed < 0;
    set->struck = enters;
    if (*agrees) {
        /* Contacts that the closed ones keep closed as well, whatever their forces. */
        bool any = false;
        for (int i = 0; i < set->count; i++)
            if (set->state->view[i].contact && set->closed[i] == KMP_PRESSED_NOT && touches(set, i)) {
                set->closed[i] = KMP_PRESSED_IF_IMPLIED;
                any = true;
            }
        return any ? kmp_contact_set_press(set, linear->t, linear->q) : KEMPE_OK;
    }
    KMP_TRY(enters >= 0 && set->closed[enters] ? kmp_contact_set_check(set) : KEMPE_OK);
    if (++set->passes > MOST_PASSES + PASSES_OF_CONTACT * set->count)
        return kmp_fail(
            linear->system->context, KEMPE_E_FAILED,
            "no equilibrium is found whose contacts agree: '%s' %s in the last of %d sets of closed contacts; "
            "start from another position",
            set->state->view[changed].element->name, enters >= 0 ? "overlaps" : "pulls", set->passes);
    set->closed[changed] = enters >= 0 ? KMP_PRESSED : KMP_PRESSED_NOT;
    return KEMPE_OK;
}

kempe_status kmp_contact_set_check(const kmp_contact_set *set)
{
    if (set->struck < 0 || set->state->view[set->struck].word != KMP_FRICTION_WORD_SHARES)
        return KEMPE_OK;
    return kmp_fail(set->context, KEMPE_E_FAILED,
                    "no equilibrium is found: closures and closed contacts keep '%s' overlapping by %.3g; start from "
                    "another position",
                    set->state->view[set->struck].element->name, -set->gap[set->struck]);
}
