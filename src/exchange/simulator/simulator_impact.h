/* SPDX-License-Identifier: BSD-3-Clause */
/* Impacts of rigid contacts: the site at which kempe_friction.c decides on them. A part of kempe_simulator.c. */
#pragma once

#include "exchange/simulator/simulator_friction.h"
#include "integrators/impact/impact_site.h"

static void rows_at(void *self, double t, const double *q, int count, const int *row, double *g)
{
    kempe_simulator *s = ((decider *)self)->s;
    const int n = s->equations->coordinates;
    copy(n, q, s->part.q);
    (void)evaluate_loops(s, t);
    for (int k = 0; k < count; k++)
        copy(n, s->part.jacobian + (ptrdiff_t)row[k] * n, g + (ptrdiff_t)k * n);
}

static void weigh(void *self, double t, const double *q)
{
    kempe_simulator *s = ((decider *)self)->s;
    copy(s->equations->coordinates, q, s->part.q);
    kempe_arguments at = arguments_at(s, t);
    s->equations->motion(&at, s->part.mass, s->part.bias, s->part.jdqd);
    s->work.evaluations++;
}

/* Changes of the independent rates, and of the others along the tangent: P = T (T' M T)^-1 T'. */
static int ways_of(void *self, double t, const double *q, int count, const double *g, double *way)
{
    decider *d = self;
    kempe_simulator *s = d->s;
    struct kempe_simulator_parts *part = &s->part;
    const int n = s->equations->coordinates, f = freedom_of(s), r = rank_of(s);
    weigh(self, t, q);
    outcome said = evaluate_loops(s, t);
    if (said == GOOD) {
        evaluate_rates(s);
        reduce_mass(s);
        said = factor_mass(s);
    }
    for (int k = 0; said == GOOD && k < count; k++) {
        double *to = way + (ptrdiff_t)k * n;
        project(s, g + (ptrdiff_t)k * n, part->udd);
        kmp_cholesky_solve(f, part->reduced, part->udd);
        for (int i = 0; i < r; i++) {
            to[part->column[i]] = 0;
            for (int l = 0; l < f; l++)
                to[part->column[i]] += part->tangent[i + l * r] * part->udd[l];
        }
        for (int l = 0; l < f; l++)
            to[part->column[r + l]] = part->udd[l];
    }
    return status_of(d, said);
}

static double kinetic_energy(const void *self, const double *qd)
{
    const kempe_simulator *s = ((const decider *)self)->s;
    const kempe_equations *e = s->equations;
    const int n = e->coordinates;
    double sum = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n && e->coordinate_kind[i] != KEMPE_COORDINATE_STATE; j++)
            if (e->coordinate_kind[j] != KEMPE_COORDINATE_STATE)
                sum += 0.5 * qd[i] * s->part.mass[(ptrdiff_t)i * n + j] * qd[j];
    return sum;
}

static int fail_impact(void *self, kmp_impact_failure failure, double t, int count, const int *which)
{
    static const char *const sentences[] = {[KMP_IMPACT_FORCED] =
                                                "closures or drives force the surfaces into each other",
                                            [KMP_IMPACT_UNDECIDED] = "the impulses are not determined",
                                            [KMP_IMPACT_ALTERNATES] = "the impulses of friction are not determined"};
    kempe_simulator *s = ((decider *)self)->s;
    const kempe_friction *friction = s->equations->friction;
    int first = -1, contacts = 0;
    for (int k = count; k-- > 0;)
        if (friction->contact[which[k]]) {
            first = which[k];
            contacts++;
        }
    fail_with(s, "impact of %s%s at t = %.9g: %s", first < 0 ? "contacts" : name_of_element(s, first),
              contacts > 1 ? " and others" : "", t, sentences[failure]);
    return NO_SOLUTION;
}

static void count_impact(void *self, const struct kmp_impact_run *p, double t, double before, double gain)
{
    (void)p, (void)t, (void)before, (void)gain;
    ((decider *)self)->s->work.events++;
}

/* Rates after impacts at the placed, complete state, which has no row that is held. The next flight bounds the step. */
static kempe_simulator_status strike_contacts(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    decider d = {s, GOOD, 0};
    const kmp_friction_site site = site_of(&d);
    double since;
    if (e->friction->contacts == 0)
        return KEMPE_SIMULATOR_GOES;
    const kmp_impact_site impacts = {.driven = e->friction->driven != 0,
                                     .rows = rows_at,
                                     .ways = ways_of,
                                     .weigh = weigh,
                                     .kinetic = kinetic_energy,
                                     .fail = fail_impact,
                                     .tell_impact = count_impact};
    copy(e->coordinates, part->q, part->site_q);
    copy(e->coordinates, part->qd, part->site_qd);
    order_pivots(s, NULL);
    note_pivot(s);
    if (e->friction->strike(e->friction, part->decisions, part->site_room, &site, &impacts, e->coordinates, t,
                            part->site_q, part->site_qd, &since) != 0)
        return explain_decision(&d, t);
    place_state_of(s, part->site_q, part->site_qd);
    if (since > 0)
        part->state[AT_NEXT] = kmp_restart_length(part->state[AT_NEXT], 1, 0, since);
    return KEMPE_SIMULATOR_GOES;
}

/* Refuses surfaces that overlap at the start, at the placed, complete state. */
static kempe_simulator_status check_overlap(kempe_simulator *s, double t)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    decider d = {s, GOOD, 0};
    const kmp_friction_site site = site_of(&d);
    if (e->friction->contacts == 0)
        return KEMPE_SIMULATOR_GOES;
    copy(e->coordinates, part->q, part->site_q);
    copy(e->coordinates, part->qd, part->site_qd);
    const int i = e->friction->overlap(e->friction, part->decisions, part->site_room, &site, e->coordinates, t,
                                       part->site_q, part->site_qd);
    if (i < 0)
        return KEMPE_SIMULATOR_GOES;
    evaluate_changes(s, t, part->value);
    const double gap = part->value[e->friction->slot[i] + KMP_ROLE_PLACE - KMP_ROLE_SENSE];
    return fail_with(s, "%s overlaps by %.6g at the start (SI units); begin with its surfaces apart",
                     name_of_element(s, i), -gap);
}
