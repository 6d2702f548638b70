/* SPDX-License-Identifier: BSD-3-Clause */
/* Decisions on friction that sticks and on impacts, in the memory of a simulator: the functions of kempe_friction in
 * kempe_simulator.h. The sites are declared in simulator_friction.h. */
#include "exchange/simulator/kempe_simulator.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_problem.h"
#include "integrators/friction/shared_contacts.h"
#include "integrators/impact/impact_inside.h"
#include "integrators/impact/impact_problem.h"
#include <stddef.h>
#include <string.h>

/* An element lies in the place of this number of numbers of the state; the past in the place of eight. */
enum { NUMBERS_OF_ELEMENT = 24, NUMBERS_OF_PAST = 8 };
typedef char element_fits[sizeof(kmp_friction_element) <= NUMBERS_OF_ELEMENT * sizeof(double) ? 1 : -1];
typedef char past_fits[sizeof(kmp_friction_past) <= NUMBERS_OF_PAST * sizeof(double) ? 1 : -1];

/* The decision that the state keeps, without room for a new one. */
static kmp_friction_run run_in(const kempe_friction *friction, double *kept, const kmp_friction_site *site)
{
    kmp_friction_run x;
    memset(&x, 0, sizeof x);
    x.site = site;
    x.count = friction->elements;
    x.loads = friction->loads != 0;
    x.element = (kmp_friction_element *)(void *)(kept + NUMBERS_OF_PAST);
    memcpy(&x.past, kept, sizeof x.past);
    return x;
}

static double *take_room(double **at, int count)
{
    double *room = *at;
    *at += count;
    return room;
}

static int *take_indices(double **at, int count)
{
    return (int *)(void *)take_room(at, count);
}

void kempe_friction_begin(const kempe_friction *friction, double *kept)
{
    kmp_friction_run x;
    memset(kept, 0, sizeof *kept * (size_t)(NUMBERS_OF_PAST + NUMBERS_OF_ELEMENT * friction->elements));
    x = run_in(friction, kept, NULL);
    kmp_friction_begin(&x);
    memcpy(kept, &x.past, sizeof x.past);
    for (int i = 0; i < friction->elements; i++) {
        kmp_friction_element *e = &x.element[i];
        e->slot = friction->slot[i];
        e->row = friction->row[i];
        e->size = friction->size[i];
        e->regularise = friction->regularise[i];
        e->base = friction->base[i];
        e->across = friction->across[i];
        e->twin = friction->twin[i];
        e->loaded = friction->loaded[i] != 0;
        e->sides = friction->sides[i] != 0;
        e->unlimited = friction->unlimited[i];
        e->contact = friction->contact[i] != 0;
    }
}

void kempe_friction_note(const kempe_friction *friction, double *kept, const double *value)
{
    kmp_friction_run x = run_in(friction, kept, NULL);
    x.change = (double *)value; /* is read by itself */
    kmp_friction_note_values(&x);
}

void kempe_friction_let_go(const kempe_friction *friction, double *kept, const kmp_friction_site *site)
{
    kmp_friction_run x = run_in(friction, kept, site);
    kmp_friction_let_go(&x);
}

int kempe_friction_settle(const kempe_friction *friction, double *kept, double *room, const kmp_friction_site *site,
                          double t, double *q, double *qd)
{
    kmp_friction_run x = run_in(friction, kept, site);
    const int n = friction->elements;
    double **const arrays[] = {&x.a, &x.lower, &x.upper, &x.under, &x.f, &x.y, &x.tried, &x.aside, &x.found};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        *arrays[k] = take_room(&room, n);
    x.which = take_indices(&room, n);
    x.side = take_indices(&room, n);
    x.partner = take_indices(&room, n);
    x.d = take_room(&room, n * n);
    x.room = take_room(&room, kmp_sharing_room(n));
    x.change = room;
    int status = kmp_friction_settle_modes(&x, t, q, qd);
    memcpy(kept, &x.past, sizeof x.past);
    return status;
}

/* -- impacts --------------------------------------------------------------------------------------------------- */

static kmp_impact_run impacts_in(kmp_friction_run *x, double *room, const kmp_impact_site *site, int n)
{
    const int most = x->count;
    kmp_impact_run p;
    memset(&p, 0, sizeof p);
    p.site = site;
    p.friction = x;
    p.n = n;
    double **const arrays[] = {&p.v, &p.a, &p.e, &p.lower, &p.upper, &p.f, &p.y, &p.tried, &p.most_friction, &p.deep};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        *arrays[k] = take_room(&room, most);
    int **const indices[] = {&p.which, &p.partner, &p.side, &p.first, &p.last};
    for (size_t k = 0; k < sizeof indices / sizeof *indices; k++)
        *indices[k] = take_indices(&room, most);
    p.held = (bool *)(void *)take_room(&room, most);
    p.row = take_room(&room, most * n);
    p.way = take_room(&room, most * n);
    p.d = take_room(&room, most * most);
    p.room = take_room(&room, kmp_sharing_room(most));
    p.before = take_room(&room, n);
    x->change = room;
    return p;
}

int kempe_friction_strike(const kempe_friction *friction, double *kept, double *room, const kmp_friction_site *site,
                          const kmp_impact_site *impacts, int n, double t, double *q, double *qd, double *since)
{
    kmp_friction_run x = run_in(friction, kept, site);
    kmp_impact_run p = impacts_in(&x, room, impacts, n);
    double gain;
    int status = kmp_impact_decide(&p, t, q, qd, &gain);
    memcpy(kept, &x.past, sizeof x.past);
    *since = p.since;
    return status;
}

int kempe_friction_overlap(const kempe_friction *friction, double *kept, double *room, const kmp_friction_site *site,
                           int n, double t, const double *q, const double *qd)
{
    kmp_friction_run x = run_in(friction, kept, site);
    kmp_impact_run p = impacts_in(&x, room, NULL, n);
    return kmp_impact_overlap(&p, t, q, qd);
}
