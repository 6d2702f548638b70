/* SPDX-License-Identifier: BSD-3-Clause */
/* Steady motions that need no names. A coordinate is cyclic if no force, closure or mass changes with it, so that only
 * its rate counts (Pars, A Treatise on Analytical Dynamics, 1965, ch. 10). A relative equilibrium has all cyclic rates
 * constant. Rates that forces decide are unknowns in place of the positions. A rate that they leave undecided, as the
 * speed of a vehicle that rolls freely, is the rate of the start. */
#include "analyses/equilibrium/running_state.h"
#include "analyses/dense/singular_values.h"
#include "analyses/equilibrium/equilibrium_study.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/data/state.h"
#include <math.h>
#include <string.h>

enum { MOST_NAMED = 12 };
#define UNDECIDED 1e-9 /* a singular value of the scaled derivatives of R below: a direction of rates is undecided */
#define AT_REST   1e-9 /* relative to the rate of the start */
#define UNCHANGED 1e-7 /* of R at a distance, relative to the forces that act */

/* -- candidates -------------------------------------------------------------------------------------- */

/* True if R along u_i changes with the rate of u_k, beyond rounding. */
static bool is_changed_by(const kmp_linear *l, int i, int k, double rate, const double *work)
{
    return fabs(l->damping[i + k * l->p]) * kmp_descent_scale(l, i) * fmax(kmp_descent_scale(l, k), fabs(rate)) >
           KMP_WAY_FLAT * work[i];
}

/* True if a force may depend on the rate of u_k: along u_k, or by a state, as the slip of a tyre that builds up. */
static bool is_resisted(const kmp_linear *l, int k, double rate, const double *work)
{
    bool resisted = is_changed_by(l, k, k, rate, work);
    for (int i = 0; i < l->p && !resisted; i++)
        resisted = kmp_state_of(l->system->model, l->part.u[i]) && is_changed_by(l, i, k, rate, work);
    return resisted;
}

/* Finds the coordinates that nothing depends on at the start: `steady` receives the coordinates whose rates a force
 * resists, to be found beginning with the rates qd (n). `running` also receives the coordinates that keep the rate of
 * the start, and has no entry if the start gives none of them a rate. */
static kempe_status find_cyclic(kmp_linear *l, double t, const double *q, const double *qd, kmp_search *steady,
                                kmp_search *running)
{
    double *work = KMP_NEW(double, l->n), most;
    bool moves = false;
    kempe_status status = work ? kmp_linear_choose(l, t, q, NULL, 0) : kmp_fail_memory(l->system->context);
    if (status == KEMPE_OK && kmp_linear_at_rates(l, t, q, qd, false) == KEMPE_OK) {
        kmp_linear_matrices(l);
        (void)kmp_descent_measure(l, work, &most);
        for (int k = 0; k < l->p; k++) {
            int c = l->part.u[k];
            if (!kmp_descent_is_idle(l, k, work))
                continue;
            const bool resisted = is_resisted(l, k, qd[c], work);
            const double own = l->damping[k + k * l->p];
            if (own > 0 || (resisted && own >= 0))
                steady->rates[steady->rate_count++] =
                    (kmp_steady){.coordinate = c, .rate = qd[c], .how = KMP_RATE_FREED};
            if (resisted || qd[c] != 0)
                running->rates[running->rate_count++] =
                    (kmp_steady){.coordinate = c, .rate = qd[c], .how = resisted ? KMP_RATE_FREED : KMP_RATE_KEPT};
            moves = moves || qd[c] != 0;
        }
    }
    running->rate_count = moves ? running->rate_count : 0;
    kmp_free(work);
    return status;
}

/* -- rates that no force decides ----------------------------------------------------------------------- */

static bool is_held(const kmp_search *search, int coordinate)
{
    for (int i = 0; i < search->rate_count; i++)
        if (search->rates[i].coordinate == coordinate)
            return search->rates[i].how == KMP_RATE_HELD;
    return false;
}

/* The scaled derivatives of R by the unknowns, without those rates that are kept; `rate` (p): the entry of
 * search->rates of each unknown, -1: a position. Returns their number. */
static int fill_derivatives(const kmp_linear *l, const kmp_search *search, const double *work, double *matrix,
                            int *rate, int *place)
{
    int p = l->p, count = 0;
    for (int k = 0; k < p; k++) {
        int entry = -1;
        for (int i = 0; i < search->rate_count; i++)
            entry = search->rates[i].coordinate == l->part.u[k] ? i : entry;
        bool freed = entry >= 0 && search->rates[entry].how == KMP_RATE_FREED;
        if (entry >= 0 && !freed)
            continue;
        double unit = kmp_descent_scale(l, k), *column = matrix + count * p;
        unit = freed ? fmax(unit, fabs(search->rates[entry].rate)) : unit;
        for (int i = 0; i < p; i++) {
            if (is_held(search, l->part.u[i])) { /* any load is there */
                column[i] = 0;
                continue;
            }
            double change = (freed ? l->damping : l->stiffness)[i + k * p] * unit * kmp_descent_scale(l, i);
            column[i] = work[i] > 0 ? change / work[i] : 0;
        }
        place[count] = k;
        rate[count++] = entry;
    }
    return count;
}

/* A rate that no force determines, of the rates to be found: the one with the largest energy in the directions along
 * which R does not change, to first order. `*entry`: -1, none. */
static kempe_status find_undecided(const kmp_linear *l, const kmp_search *search, kmp_arena *arena, int *entry)
{
    int p = l->p, *rate, *place;
    double *work, *matrix, most, largest = 0;
    kmp_singular svd;
    *entry = -1;
    KMP_TRY(
        kmp_made(l->system->context, KMP_ARENA_MAKE(arena, KMP_ROOM(double, p, &work), KMP_ROOM(int, p, &rate, &place),
                                                    KMP_ROOM(double, p *p, &matrix))));
    (void)kmp_descent_measure(l, work, &most);
    int count = fill_derivatives(l, search, work, matrix, rate, place);
    KMP_TRY(kmp_made(l->system->context, count == 0 || kmp_singular_init(&svd, arena, p, count)));
    if (count == 0 || !kmp_singular_decompose(&svd, matrix))
        return KEMPE_OK;
    for (int k = 0; k < count; k++) {
        double part = 0;
        for (int j = 0; rate[k] >= 0 && j < svd.k; j++)
            part += svd.s[j] <= UNDECIDED * svd.s[0] ? svd.vt[j + k * svd.k] * svd.vt[j + k * svd.k] : 0;
        if (part <= UNDECIDED)
            continue;
        double speed = search->rates[rate[k]].rate, energy = part * l->mass[place[k] + place[k] * p] * speed * speed;
        if (energy > largest) {
            largest = energy;
            *entry = rate[k];
        }
    }
    return KEMPE_OK;
}

/* -- a steady motion from a start that moves ----------------------------------------------------------- */

/* Newton's method first if rates are to be found, otherwise the descent; then the other one. */
static kempe_status find_from(kmp_linear *l, double t, double *q, kmp_search *search)
{
    bool newton = false;
    for (int i = 0; i < search->rate_count; i++)
        newton = newton || search->rates[i].how == KMP_RATE_FREED;
    search->newton = newton;
    kempe_status status = kmp_equilibrium_find(l, t, q, search);
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(l->system->context);
    search->newton = !newton;
    return kmp_equilibrium_find(l, t, q, search);
}

/* Keeps rates of the start, one after another, until forces decide all others. `start` (n): q of the start. */
static kempe_status keep_undecided(kmp_linear *l, double t, const double *start, const double *qd, double *q,
                                   kmp_search *search, kmp_arena *arena)
{
    int entry;
    KMP_TRY(find_undecided(l, search, arena, &entry));
    while (entry >= 0) {
        kmp_steady *kept = &search->rates[entry];
        kept->how = KMP_RATE_KEPT;
        for (int i = 0; i < search->rate_count; i++)
            search->rates[i].rate = qd[search->rates[i].coordinate];
        memcpy(q, start, (size_t)l->n * sizeof *q);
        KMP_TRY(find_from(l, t, q, search));
        KMP_TRY(find_undecided(l, search, arena, &entry));
    }
    return KEMPE_OK;
}

/* True if the state moves, and nothing depends on the coordinates that do. */
static bool goes_on(kmp_linear *l, const double *qd, const kmp_search *search, int *idle)
{
    int count = kmp_equilibrium_idle(l, idle);
    bool moves = false, cyclic = count >= 0;
    for (int i = 0; i < search->rate_count; i++) {
        const kmp_steady *s = &search->rates[i];
        bool found = s->rate == 0;
        for (int k = 0; k < count; k++)
            found = found || idle[k] == s->coordinate;
        cyclic = cyclic && found;
        moves = moves || fabs(s->rate) > AT_REST * fabs(qd[s->coordinate]);
    }
    return moves && cyclic;
}

/* The distance of u_k in the direction of its rate at which R is found changed; 0: R is unchanged at all of them. */
static double find_change(kmp_linear *l, double t, const double *q, const double *ud, int k, const double *way,
                          const double *residual, const double *work, double *moved)
{
    static const double distances[] = {1, 3, 10, 30, 100};
    for (size_t d = 0; d < sizeof distances / sizeof *distances; d++) {
        double far = copysign(distances[d] * kmp_descent_scale(l, k), ud[k]);
        for (int i = 0; i < l->n; i++)
            moved[i] = q[i] + far * way[i];
        if (kmp_linear_residual_at(l, t, moved, ud) != KEMPE_OK)
            return 0;
        for (int i = 0; i < l->p; i++)
            if (!(fabs(l->residual[i] - residual[i]) * kmp_descent_scale(l, i) <= UNCHANGED * work[i]))
                return far;
    }
    return 0;
}

/* Warns of a motion that is steady only near the start. */
static kempe_status warn_of_changes(kmp_linear *l, double t, const kmp_search *search, kmp_arena *arena)
{
    const kempe_model *model = l->system->model;
    double *q, *ud, *way, *residual, *work, *moved, most;
    KMP_TRY(kmp_made(model->context, KMP_ARENA_EACH(arena, double, l->n, &q, &ud, &way, &residual, &work, &moved)));
    (void)kmp_descent_measure(l, work, &most);
    memcpy(q, l->q, (size_t)l->n * sizeof *q);
    memcpy(residual, l->residual, (size_t)l->p * sizeof *residual);
    for (int k = 0; k < l->p; k++)
        ud[k] = l->qd[l->part.u[k]];
    for (int i = 0; i < search->rate_count; i++) {
        int c = search->rates[i].coordinate, k = kmp_linear_place(l, c);
        if (k < 0 || ud[k] == 0)
            continue;
        memcpy(way, l->red.x + (ptrdiff_t)k * l->n, (size_t)l->n * sizeof *way);
        double far = find_change(l, t, q, ud, k, way, residual, work, moved);
        kmp_shown as = kmp_shown_as(model->context, model->motions[c].rotation ? "rad" : "m");
        if (far != 0)
            kmp_log(model->context, KEMPE_LOG_WARNING,
                    "the motion is steady only near the start: forces change before '%s' has moved by %.3g %s (curve, "
                    "gradient or irregularities of a track, or an expression)",
                    model->motions[c].name, as.factor * far, as.unit);
        KMP_TRY(kmp_linear_residual_at(l, t, q, ud));
    }
    KMP_TRY(kmp_linear_at(l, t, q, ud, NULL));
    kmp_linear_matrices(l);
    return KEMPE_OK;
}

/* Searches a steady motion from a start that moves; *found: there is one, in q and search. */
static kempe_status run_once(kmp_linear *l, double t, double *q, const double *qd, kmp_search *search, kmp_arena *arena,
                             bool *found)
{
    size_t n = (size_t)l->n;
    double *at = KMP_ARENA_NEW(arena, double, n);
    int *idle = KMP_ARENA_NEW(arena, int, n);
    *found = false;
    KMP_TRY(kmp_made(l->system->context, at && idle));
    memcpy(at, q, n * sizeof *at);
    kempe_status status = find_from(l, t, at, search);
    if (status == KEMPE_OK)
        status = keep_undecided(l, t, q, qd, at, search, arena);
    if (status == KEMPE_OK && goes_on(l, qd, search, idle)) {
        memcpy(q, at, n * sizeof *q);
        *found = true;
        return search->warned ? KEMPE_OK : warn_of_changes(l, t, search, arena);
    }
    if (status == KEMPE_E_FAILED)
        kmp_context_clear(l->system->context);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

/* Searches a steady motion from a start that moves. A vehicle that resistances would stop has its speed held. */
static kempe_status run_on(kmp_linear *l, double t, double *q, const double *qd, kmp_search *search, kmp_arena *arena,
                           bool *found)
{
    size_t count = (size_t)search->rate_count;
    kmp_steady *given = KMP_ARENA_NEW(arena, kmp_steady, count);
    /* The coordinate along which a vehicle on rails moves fastest at the start, among `rates`: its entry; -1: none. */
    const kempe_model *model = l->system->model;
    int travel = -1;
    for (int i = 0; model->wheel_count > 0 && i < search->rate_count; i++) {
        int c = search->rates[i].coordinate;
        if (!model->motions[c].rotation && qd[c] != 0 &&
            (travel < 0 || fabs(qd[c]) > fabs(qd[search->rates[travel].coordinate])))
            travel = i;
    }
    KMP_TRY(kmp_made(l->system->context, given));
    memcpy(given, search->rates, count * sizeof *given);
    KMP_TRY(run_once(l, t, q, qd, search, arena, found));
    if (*found || travel < 0)
        return KEMPE_OK;
    memcpy(search->rates, given, count * sizeof *given);
    search->rates[travel].how = KMP_RATE_HELD;
    return run_once(l, t, q, qd, search, arena, found);
}

/* -- from a start at rest ------------------------------------------------------------------------------ */

/* Searches a steady motion where no rest was found, for the reason `why`. */
static kempe_status go_on(kmp_linear *l, double t, double *q, kmp_search *steady, const char *why)
{
    kempe_context *context = l->system->context;
    kmp_text names = {0};
    const kempe_model *model = l->system->model;
    for (int k = 0; k < steady->rate_count && k < MOST_NAMED; k++)
        kmp_text_printf(&names, "%s%s", k ? ", " : "", model->motions[steady->rates[k].coordinate].name);
    if (steady->rate_count > MOST_NAMED)
        kmp_text_printf(&names, " and %d more", steady->rate_count - MOST_NAMED);
    kempe_status status = kmp_equilibrium_find(l, t, q, steady);
    if (status == KEMPE_OK)
        kmp_log(context, KEMPE_LOG_INFO,
                "no equilibrium at rest exists: a steady motion is found, with the velocities of %s", names.s);
    else if (status == KEMPE_E_FAILED) {
        char *last = kmp_strdup(kempe_context_message(context));
        kmp_context_clear(context);
        (void)kmp_fail(context, status,
                       "%s; and no steady motion is found from the start with the rates of %s unknown: %s; give rates "
                       "that are nearer (--rates 'NAME=RATE,..', --solve-for 'qd(NAME),..')",
                       why, names.s, last ? last : "no memory");
        kmp_free(last);
    }
    kmp_text_free(&names);
    return status;
}

/* A vehicle on rails whose start moves is found at rest: its name for that. */
static void warn_of_rest(const kmp_linear *l, const double *qd, const kmp_search *search)
{
    const kempe_model *model = l->system->model;
    int fastest = -1;
    for (int i = 0; model->wheel_count > 0 && i < kmp_model_coordinates(model); i++)
        if (!model->motions[i].rotation && qd[i] != 0 && (fastest < 0 || fabs(qd[i]) > fabs(qd[fastest])))
            fastest = i;
    if (fastest < 0 || search->warned)
        return;
    kmp_shown as = kmp_shown_as(model->context, "m/s");
    kmp_log(model->context, KEMPE_LOG_WARNING,
            "the equilibrium is at rest, although the start moves ('%s' at %.4g %s): no steady motion is found near "
            "the start; take --at start in modes, or give a drive",
            model->motions[fastest].name, as.factor * qd[fastest], as.unit);
}

/* Searches a rest, and a steady motion where there is none. */
static kempe_status rest_or_go_on(kmp_linear *l, double t, double *q, kmp_search *search, kmp_search *steady)
{
    kempe_context *context = l->system->context;
    search->quiet = steady->rate_count > 0;
    kempe_status status = kmp_equilibrium_find(l, t, q, search);
    if (status != KEMPE_E_FAILED || steady->rate_count == 0)
        return status;
    char *why = kmp_strdup(kempe_context_message(context));
    kmp_context_clear(context);
    status = why ? go_on(l, t, q, steady, why) : kmp_fail_memory(context);
    kmp_free(why);
    if (status == KEMPE_OK) {
        kmp_steady *rates = search->rates;
        memcpy(rates, steady->rates, (size_t)steady->rate_count * sizeof *rates);
        *search = *steady;
        search->rates = rates;
    }
    return status;
}

/* Searches a steady motion from q, at the rates qd (n) of a start that moves. */
static kempe_status run_from(kmp_linear *l, double t, double *q, const double *qd, kmp_search *search,
                             kmp_search *steady, bool *found)
{
    kmp_arena arena = {0};
    kmp_search running = {.quiet = true, .warned = search->warned, .rates = KMP_ARENA_NEW(&arena, kmp_steady, l->n)};
    kempe_status status = kmp_made(l->system->context, running.rates);
    *found = false;
    if (status == KEMPE_OK)
        status = find_cyclic(l, t, q, qd, steady, &running);
    if (status == KEMPE_OK && running.rate_count > 0)
        status = run_on(l, t, q, qd, &running, &arena, found);
    if (status == KEMPE_OK && *found) {
        memcpy(search->rates, running.rates, (size_t)running.rate_count * sizeof *running.rates);
        running.rates = search->rates;
        running.quiet = false;
        *search = running;
    }
    kmp_arena_free(&arena);
    return status;
}

/* After a rest is found although the start moves, searches a steady motion from that rest: wheels may press only
 * there. */
static kempe_status run_from_rest(kmp_linear *l, double t, double *q, const double *qd, kmp_search *search)
{
    bool found = false;
    if (search->rate_count > 0)
        return KEMPE_OK;
    bool moves = false;
    double most;
    (void)kmp_descent_measure(l, l->unit, &most);
    for (int k = 0; k < l->p; k++)
        moves = moves || (qd[l->part.u[k]] != 0 && kmp_descent_is_idle(l, k, l->unit));
    if (!moves) {
        warn_of_rest(l, qd, search);
        return KEMPE_OK;
    }
    kmp_steady *room = KMP_NEW(kmp_steady, l->n);
    kmp_search steady = {.rates = room}, again = {.newton = true, .quiet = true, .rates = search->rates};
    kempe_status status = kmp_made(l->system->context, room);
    if (status == KEMPE_OK)
        status = run_from(l, t, q, qd, search, &steady, &found);
    kmp_free(room);
    if (status != KEMPE_OK || found)
        return status;
    warn_of_rest(l, qd, search);
    return kmp_equilibrium_find(l, t, q, &again);
}

/* Lets the wheels of a vehicle press at the rates of its start (qd): coordinates that move are fixed, by any load. */
static kempe_status press_wheels(kmp_linear *l, double t, double *q, const double *qd)
{
    const kempe_model *model = l->system->model;
    kmp_steady *rates = KMP_NEW(kmp_steady, l->n);
    kmp_search search = {.balanced = true, .quiet = true, .rates = rates};
    KMP_TRY(kmp_made(model->context, rates));
    kempe_status status = kmp_linear_choose(l, t, q, NULL, 0);
    for (int k = 0; status == KEMPE_OK && k < l->p; k++) {
        int c = l->part.u[k];
        if (c < kmp_model_coordinates(model) && qd[c] != 0)
            rates[search.rate_count++] = (kmp_steady){.coordinate = c, .rate = qd[c], .how = KMP_RATE_HELD};
    }
    if (status == KEMPE_OK)
        status = search.rate_count > 0 ? kmp_equilibrium_find(l, t, q, &search) : KEMPE_E_FAILED;
    kmp_free(rates);
    return status;
}

/* Searches a steady motion of a vehicle without a rest, whose wheels do not press at the start; the context has the
 * reason why no rest is found. Creep forces at rest may have no balance. */
static kempe_status run_pressed(kmp_linear *l, double t, double *q, const double *qd, kmp_search *search,
                                kmp_search *steady)
{
    kempe_context *context = l->system->context;
    char *why = kmp_strdup(kempe_context_message(context));
    bool found = false;
    KMP_TRY(kmp_made(context, why));
    kmp_context_clear(context);
    search->rate_count = steady->rate_count = 0;
    kempe_status status = press_wheels(l, t, q, qd);
    if (status == KEMPE_OK)
        status = run_from(l, t, q, qd, search, steady, &found);
    if (status == KEMPE_E_FAILED || (status == KEMPE_OK && !found)) {
        kmp_context_clear(context);
        status = kmp_fail(context, KEMPE_E_FAILED, "%s", why);
    }
    kmp_free(why);
    return status;
}

/* q (n) with all independent coordinates at zero, except states and coordinates that the start gives a rate. False:
 * loops do not close there, or it is the start itself. */
static bool go_to_middle(kmp_linear *l, double t, double *q, const double *qd)
{
    bool moved = false;
    if (kmp_linear_choose(l, t, q, NULL, 0) != KEMPE_OK)
        return false;
    for (int k = 0; k < l->p; k++) {
        int c = l->part.u[k];
        if (qd[c] != 0 || c >= kmp_model_coordinates(l->system->model))
            continue;
        moved = moved || q[c] != 0;
        q[c] = 0;
    }
    if (!moved || kmp_linear_at(l, t, q, NULL, NULL) != KEMPE_OK)
        return false;
    memcpy(q, l->q, (size_t)l->n * sizeof *q);
    return true;
}

/* Searches a steady motion from the middle, where none is found from the start: with creep forces at their bound, which
 * do not change with small displacements, Newton's method leads nowhere. The context has the reason of the failure. */
static kempe_status run_from_middle(kmp_linear *l, double t, double *q, const double *qd, kmp_search *search)
{
    kempe_context *context = l->system->context;
    char *why = kmp_strdup(kempe_context_message(context));
    kmp_steady *room = KMP_NEW(kmp_steady, l->n);
    double *middle = KMP_NEW(double, l->n);
    kmp_search steady = {.newton = true, .rates = room};
    kempe_status status = kmp_made(context, why && room && middle);
    bool found = false;
    if (status == KEMPE_OK) {
        kmp_context_clear(context);
        search->rate_count = 0;
        memcpy(middle, q, (size_t)l->n * sizeof *middle);
        if (go_to_middle(l, t, middle, qd))
            status = run_from(l, t, middle, qd, search, &steady, &found);
    }
    if (found) {
        memcpy(q, middle, (size_t)l->n * sizeof *q);
        kmp_log(context, KEMPE_LOG_INFO,
                "no steady motion is found from the displacements of the start: one is found from the place without "
                "them, all independent coordinates at zero");
    } else if (status == KEMPE_OK || status == KEMPE_E_FAILED) {
        kmp_context_clear(context);
        status = kmp_fail(context, KEMPE_E_FAILED, "%s", why);
    }
    kmp_free(middle);
    kmp_free(room);
    kmp_free(why);
    return status;
}

kempe_status kmp_equilibrium_or_steady(kmp_linear *linear, double t, double *q, const double *qd, kmp_search *search)
{
    if (search->rate_count > 0 || search->newton || search->quiet || search->exchange)
        return kmp_equilibrium_find(linear, t, q, search);
    kmp_steady *room = KMP_NEW(kmp_steady, linear->n);
    kmp_search steady = {.newton = true, .rates = room};
    bool found = false;
    kempe_status status = kmp_made(linear->system->context, room);
    if (status == KEMPE_OK)
        status = run_from(linear, t, q, qd, search, &steady, &found);
    if (status == KEMPE_OK && !found) {
        status = rest_or_go_on(linear, t, q, search, &steady);
        if (status == KEMPE_E_FAILED && linear->system->model->wheel_count > 0)
            status = run_pressed(linear, t, q, qd, search, &steady);
        else if (status == KEMPE_OK)
            status = run_from_rest(linear, t, q, qd, search);
    }
    if (status == KEMPE_E_FAILED)
        status = run_from_middle(linear, t, q, qd, search);
    kmp_free(room);
    return status;
}
