/* SPDX-License-Identifier: BSD-3-Clause */
/* Rigid contacts at an equilibrium. */
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "studies/equilibrium/balances.h"
#include <math.h>
#include <string.h>

const char *kmp_contact_text(kmp_contact_word word)
{
    static const char *const words[] = {[KMP_CONTACT_OPEN] = "open",
                                        [KMP_CONTACT_PRESSES] = "presses",
                                        [KMP_CONTACT_TOUCHES] = "touches",
                                        [KMP_CONTACT_SHARES] = "shares"};
    return words[word];
}

static int row_of(const kempe_system *s, const kmp_force *contact)
{
    for (int r = 0; r < s->m; r++)
        if (s->rows[r].closure == contact->closure)
            return r;
    return 0;
}

/* The largest force of a contact, in J of its size. */
static double largest_work(const kmp_balance *b)
{
    double most = 0;
    for (int i = 0; i < b->contact_count; i++)
        most = fmax(most, fabs(b->contact[i].force) * b->contact[i].size);
    return most;
}

static kmp_contact_word word_of(const kmp_balance_contact *c, bool closed, bool shares, double least)
{
    if (shares)
        return KMP_CONTACT_SHARES;
    if (!closed)
        return c->gap <= KMP_TOUCH_NEAR * c->size ? KMP_CONTACT_TOUCHES : KMP_CONTACT_OPEN;
    return fabs(c->force) * c->size <= least ? KMP_CONTACT_TOUCHES : KMP_CONTACT_PRESSES;
}

/* Tells what small motions, or other forces, depend on. */
static void tell(const kempe_equilibrium *e, const kmp_balance *b, kmp_contact_word word, const char *what)
{
    kmp_text names = {0};
    int count = 0;
    for (int i = 0; i < b->contact_count; i++)
        if (b->contact[i].word == word)
            kmp_text_printf(&names, "%s'%s'", count++ ? ", " : "", b->contact[i].element->name);
    if (names.s)
        kmp_log(e->system->context, KEMPE_LOG_WARNING, "contact%s %s: %s", count == 1 ? "" : "s", names.s, what);
    kmp_text_free(&names);
}

kempe_status kmp_balance_look_at_contacts(kempe_equilibrium *equilibrium, kmp_linear *linear, kmp_balance *balance)
{
    const kmp_friction_state *f = equilibrium->friction;
    kempe_context *context = equilibrium->system->context;
    if (!kmp_model_has_contacts(equilibrium->system->model))
        return KEMPE_OK;
    double *place = KMP_ARENA_NEW(&equilibrium->arena, double, f->count);
    balance->contact = KMP_ARENA_NEW(&equilibrium->arena, kmp_balance_contact, f->count);
    KMP_TRY(kmp_made(context, place && balance->contact));
    kmp_friction_state_measure(equilibrium->friction, linear->t, linear->q, place);
    for (int i = 0; i < f->count; i++) {
        kmp_held_contact how = kmp_friction_state_closed(f, i);
        if (f->view[i].contact)
            balance->contact[balance->contact_count++] = (kmp_balance_contact){.element = f->view[i].element,
                                                                               .size = f->view[i].size,
                                                                               .gap = place[i],
                                                                               .closed = how != KMP_HELD_NOT,
                                                                               .shares = how == KMP_HELD_BY_OTHERS};
    }
    return KEMPE_OK;
}

void kmp_balance_add_contacts(kempe_equilibrium *equilibrium, kmp_balance *balance)
{
    const kempe_system *s = equilibrium->system;
    for (int i = 0; i < balance->contact_count; i++)
        balance->contact[i].force = balance->lambda[row_of(s, balance->contact[i].element)];
    double least = KMP_CONTACT_NONE * fmax(largest_work(balance), balance->work);
    for (int i = 0; i < balance->contact_count; i++) {
        kmp_balance_contact *c = &balance->contact[i];
        c->word = word_of(c, c->closed, c->shares, least);
    }
    if (equilibrium->count > 0)
        return;
    tell(equilibrium, balance, KMP_CONTACT_TOUCHES,
         "surfaces touch here without a force; small motions open or close them");
    tell(equilibrium, balance, KMP_CONTACT_SHARES,
         "closed by the rows of others, so that forces are not unique; one set of them is taken");
}
