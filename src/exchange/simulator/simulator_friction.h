/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction that sticks and impacts of rigid contacts: the sites at which kempe_friction.c decides on them. Rows that
 * are held change the rank. A part of kempe_simulator.c. */
#pragma once

#include "dynamics/kinematics/friction_roles.h"
#include "exchange/simulator/simulator_conditions.h"
#include "integrators/friction/friction_site.h"
#include "integrators/impact/impact_site.h"

/* The status of a decision that fails. */
enum { NO_SOLUTION = 1 };

/* The simulator that decides; the last outcome that is not good. */
typedef struct decider {
    kempe_simulator *s;
    outcome said;
    double still; /* a rate that counts as none, where it is more than rounding */
} decider;

/* Places the state. */
static void place_state_of(kempe_simulator *s, const double *q, const double *qd)
{
    copy(s->equations->coordinates, q, s->part.q);
    copy(s->equations->coordinates, qd, s->part.qd);
}

static int status_of(decider *d, outcome said)
{
    d->said = said;
    return said == GOOD ? 0 : NO_SOLUTION;
}

static kmp_friction_numbers numbers_of(const void *self)
{
    const decider *d = self;
    const kempe_simulator *s = d->s;
    return (kmp_friction_numbers){KMP_FRICTION_SPAN / s->part.state[AT_RATE], s->settings.rtol,
                                  fmax(KMP_FRICTION_STILL, d->still)};
}

static double pace_of_rates(const kempe_simulator *s, const double *qd)
{
    double rate = s->part.state[AT_RATE];
    for (int i = 0; i < s->equations->coordinates; i++)
        rate = fmax(rate, fabs(qd[i]) / s->equations->scale[i]);
    return rate;
}

static double pace_of(const void *self, const double *qd)
{
    return pace_of_rates(((const decider *)self)->s, qd);
}

static void put_input(void *self, int condition, double input)
{
    ((decider *)self)->s->part.modes[condition] = input;
}

/* The number of pivots of the last choice that count. */
static int count_pivots(const kempe_simulator *s)
{
    const kempe_equations *e = s->equations;
    const double *pivots = s->part.pivots;
    int count = e->rows < e->coordinates ? e->rows : e->coordinates, rank = 0;
    while (rank < count && pivots[rank] > e->rank_tolerance * pivots[0])
        rank++;
    return rank;
}

/* The last pivot of the rows that are kept. */
static void note_pivot(kempe_simulator *s)
{
    *s->part.last_pivot = rank_of(s) > 0 ? s->part.pivots[rank_of(s) - 1] : 0;
}

static int choose_rows(void *self, double t, const double *q)
{
    decider *d = self;
    kempe_simulator *s = d->s;
    copy(s->equations->coordinates, q, s->part.q);
    (void)evaluate_loops(s, t);
    order_pivots(s, NULL);
    s->part.rank = count_pivots(s);
    note_pivot(s);
    take_order(s);
    outcome said = improve_choice(s, t);
    return status_of(d, said == GOOD ? evaluate_loops(s, t) : said);
}

static int adds_row(void *self, double t, const double *q, bool *adds)
{
    kempe_simulator *s = ((decider *)self)->s;
    const struct kempe_simulator_parts *part = &s->part;
    copy(s->equations->coordinates, q, part->q);
    (void)evaluate_loops(s, t);
    order_pivots(s, NULL);
    const int rank = count_pivots(s), before = rank_of(s);
    const double least = before > 0 ? *part->last_pivot : part->pivots[0];
    *adds = rank > before && part->pivots[rank - 1] > KMP_FRICTION_RANK * least;
    return 0;
}

/* Rates of places that are not held yet may be a little off the rows: they stay as they are. */
static int measure(void *self, double t, const double *q, const double *qd, double *change)
{
    decider *d = self;
    kempe_simulator *s = d->s;
    place_state_of(s, q, qd);
    outcome said = evaluate_loops(s, t);
    if (said == GOOD) {
        evaluate_rates(s);
        copy(s->equations->coordinates, qd, s->part.qd);
        said = accelerate(s, t);
    }
    if (said == GOOD) {
        complete(s);
        evaluate_changes(s, t, change);
    }
    return status_of(d, said);
}

static void look(void *self, double t, const double *q, const double *qd, double *change)
{
    kempe_simulator *s = ((decider *)self)->s;
    place_state_of(s, q, qd);
    evaluate_changes(s, t, change);
}

/* The nearest rates by kinetic energy, and accelerations there. */
static int finish(void *self, double t, double *q, double *qd, double *change)
{
    decider *d = self;
    kempe_simulator *s = d->s;
    struct kempe_simulator_parts *part = &s->part;
    (void)change; /* decisions are of all elements */
    pack_y(s, q, qd, part->probe);
    copy(s->equations->coordinates, q, part->q);
    outcome said = slopes_closed(s, t, part->probe, NULL);
    if (said == GOOD)
        said = jump(s, t, qd, part->probe);
    if (said == GOOD) {
        complete(s);
        copy(s->equations->coordinates, part->q, q);
        copy(s->equations->coordinates, part->qd, qd);
    }
    return status_of(d, said);
}

static bool is_unsettled(const void *self)
{
    return ((const decider *)self)->said == UNSETTLED;
}

static void forget(void *self)
{
    ((decider *)self)->said = GOOD;
}

/* The name of an element, by the name of one of its numbers. */
static const char *name_of_element(const kempe_simulator *s, int element)
{
    return s->equations->condition_names[s->equations->friction->slot[element] + KMP_ROLE_PLACE - KMP_ROLE_SENSE];
}

static int fail(void *self, kmp_friction_failure failure, double t)
{
    static const char *const sentences[] = {
        [KMP_FRICTION_FORCED] = "the closures or drives press the surfaces of contacts into each other",
        [KMP_FRICTION_UNDECIDED] =
            "no state of slip and stick is found, because the forces of nearly redundant contacts follow from rounding",
        [KMP_FRICTION_IMPOSSIBLE] = "it can neither slip nor stick; reduce it, or regularise it with a 'speed'",
        [KMP_FRICTION_ALTERNATES] = "slip and stick change without an end; regularise it with a 'speed'",
        [KMP_FRICTION_LOCKED] = "it moves in the direction in which it is unlimited",
        [KMP_FRICTION_JAMMED] = "closures turn it into the direction in which it is unlimited"};
    decider *d = self;
    const kempe_simulator *s = d->s;
    const bool more = s->equations->friction->elements > 1;
    fail_with(d->s, "%s%s at t = %.9g: %s", name_of_element(s, 0), more ? ", or another one," : "", t,
              sentences[failure]);
    return NO_SOLUTION;
}

static void report(void *self, kmp_friction_fact fact, int element, double t, double number)
{
    kempe_simulator *s = ((decider *)self)->s;
    const kempe_equations *e = s->equations;
    (void)element;
    s->work.events += fact == KMP_FRICTION_FACT_CHANGE;
    if ((fact == KMP_FRICTION_FACT_SHARED || fact == KMP_FRICTION_FACT_SHARED_IMPULSES) && number > 0)
        snprintf(s->message, sizeof s->message,
                 "%s: forces of redundant contacts are not unique at t = %.9g, and friction makes the motion depend on "
                 "them: use fewer contacts, or a compliant 'law'",
                 e->name, t);
}

static kmp_friction_site site_of(decider *d)
{
    return (kmp_friction_site){.self = d,
                               .failed = NO_SOLUTION,
                               .numbers = numbers_of,
                               .pace = pace_of,
                               .put = put_input,
                               .choose = choose_rows,
                               .adds = adds_row,
                               .measure = measure,
                               .look = look,
                               .finish = finish,
                               .is_unsettled = is_unsettled,
                               .forget = forget,
                               .fail = fail,
                               .report = report};
}

/* -- at an instant ------------------------------------------------------------------------------------------- */

static kempe_simulator_status explain_decision(const decider *d, double t)
{
    return d->s->message[0] ? KEMPE_SIMULATOR_FAILED : explain(d->s, d->said, t);
}

/* True where an event of friction is passed at the present values. */
static bool passes_friction(const kempe_simulator *s)
{
    bool any = false;
    for (int k = 0; k < s->equations->conditions; k++)
        any = any || (s->equations->condition_kind[k] == KEMPE_CONDITION_PASSES && s->part.value[k] < 0);
    return any;
}

/* Puts the friction of all elements in place of the multipliers of their rows: outputs read it there. */
static void show_friction(kempe_simulator *s, const double *value)
{
    const kempe_friction *friction = s->equations->friction;
    for (int i = 0; friction && i < friction->elements; i++)
        s->part.lambda[friction->row[i]] = value[friction->slot[i] + KMP_ROLE_GIVEN - KMP_ROLE_SENSE];
}

/* Notes the friction at the state y, and lets go of the rows that are held: modes are decided again. */
static kempe_simulator_status release_friction(kempe_simulator *s, double t, double *y)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    decider d = {s, GOOD, 0};
    const kmp_friction_site site = site_of(&d);
    outcome said = slopes_closed(s, t, y, NULL);
    if (said != GOOD)
        return explain(s, said, t);
    complete(s);
    evaluate_changes(s, t, part->value);
    for (int k = 0; k < e->conditions; k++) /* the event has been located beyond zero */
        if (e->condition_kind[k] == KEMPE_CONDITION_PASSES && part->flip[k] > 0)
            part->value[k] = fmin(part->value[k], -DBL_MIN);
    e->friction->note(e->friction, part->decisions, part->value);
    e->friction->let_go(e->friction, part->decisions, &site);
    copy(e->coordinates, part->q, part->site_q);
    copy(e->coordinates, part->qd, part->site_qd);
    if (rank_of(s) > least_rank(e) && choose_rows(&d, t, part->site_q) != 0)
        return explain_decision(&d, t);
    place_state_of(s, part->site_q, part->site_qd);
    pack_y(s, part->q, part->qd, y);
    return KEMPE_SIMULATOR_GOES;
}

/* Decides on the modes of friction at the placed, complete state, which has no row that is held. `still`: of an
 * occasion. */
static kempe_simulator_status settle_friction(kempe_simulator *s, double t, double *y, double still)
{
    const kempe_equations *e = s->equations;
    struct kempe_simulator_parts *part = &s->part;
    decider d = {s, GOOD, still};
    const kmp_friction_site site = site_of(&d);
    copy(e->coordinates, part->q, part->site_q);
    copy(e->coordinates, part->qd, part->site_qd);
    order_pivots(s, NULL);
    note_pivot(s);
    if (e->friction->settle(e->friction, part->decisions, part->site_room, &site, t, part->site_q, part->site_qd) != 0)
        return explain_decision(&d, t);
    evaluate_changes(s, t, part->value);
    pack_y(s, part->q, part->qd, y);
    return KEMPE_SIMULATOR_GOES;
}

/* -- impacts --------------------------------------------------------------------------------------------- */

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

/* Prepares T and T' M T. */
static int invert(void *self, double t, const double *q)
{
    decider *d = self;
    kempe_simulator *s = d->s;
    weigh(self, t, q);
    outcome said = evaluate_loops(s, t);
    if (said == GOOD) {
        evaluate_rates(s);
        reduce_mass(s);
        said = factor_mass(s);
    }
    return status_of(d, said);
}

/* Changes of the independent rates, and of the others along the tangent: P = T (T' M T)^-1 T'. */
static int way_of(void *self, const double *g, double *way)
{
    kempe_simulator *s = ((decider *)self)->s;
    const struct kempe_simulator_parts *part = &s->part;
    const int f = freedom_of(s), r = rank_of(s);
    project(s, g, part->udd);
    kmp_cholesky_solve(f, part->reduced, part->udd);
    for (int i = 0; i < r; i++) {
        way[part->column[i]] = 0;
        for (int l = 0; l < f; l++)
            way[part->column[i]] += part->tangent[i + l * r] * part->udd[l];
    }
    for (int l = 0; l < f; l++)
        way[part->column[r + l]] = part->udd[l];
    return 0;
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
                                                "the closures or drives press the surfaces into each other",
                                            [KMP_IMPACT_UNDECIDED] = "the impulses cannot be found because of rounding",
                                            [KMP_IMPACT_ALTERNATES] = "the impulses of friction do not settle"};
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
                                     .invert = invert,
                                     .way = way_of,
                                     .weigh = weigh,
                                     .kinetic = kinetic_energy,
                                     .fail = fail_impact,
                                     .report_impact = count_impact};
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
