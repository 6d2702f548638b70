/* SPDX-License-Identifier: BSD-3-Clause */
/* Descent from afar: Newton's direction with the symmetric part of Kr made positive by the moduli of its eigenvalues
 * (as by Dauphin et al., NIPS 27 (2014) 2933), so that s'R < 0. For a conservative mechanism this descends its
 * potential, for any other it follows a heavily damped motion. A step is bounded. Its length is such that the work s'R
 * along it has fallen to half at its end or is still negative (Matthies and Strang, IJNME 14 (1979) 1613): this needs
 * no potential. If R = 0 and Kr has a negative direction, the state is displaced along it. Newton's steps by least
 * squares end the search. */
#include "base/bracket.h"
#include "base/memory.h"
#include "linalg/dense/dense.h"
#include "linalg/dense/lapack.h"
#include "linalg/dot.h"
#include "studies/equilibrium/descent.h"
#include <math.h>
#include <string.h>

enum { MOST_HALVINGS = 40, MOST_PUSHES = 12, MOST_DOWN = KMP_MOST_ITERATIONS - 40 };

#define NEAR          0.003 /* Newton's step at a stable equilibrium, rad or characteristic lengths */
#define STILL         1e-6  /* at any other */
#define FIRST_BOUND   0.3   /* rad, or characteristic lengths */
#define SHORT_BOUND   1e-3
#define LONGEST       0.3
#define PUSH          0.05
#define FINE          1e-14 /* of a step that ends at a surface */
#define FARTHEST      1e4   /* a longer path is divergent */
#define RUNAWAY_TURNS 20.0  /* rad: a longer rotation without end is divergent */

/* -- directions -------------------------------------------------------------------------------------- */

/* The scaled Kr of the unknowns, and the eigenvectors and values of its symmetric part. False: no memory. */
static bool decompose(kmp_descent *w)
{
    int p = w->count;
    for (int k = 0; k < p; k++)
        w->size[k] = kmp_descent_unit(w, k) / (w->work[w->place[k]] > 0 ? sqrt(w->work[w->place[k]]) : 1);
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            w->matrix[i + k * p] = kmp_descent_entry(w, i, k) * w->size[i] * w->size[k];
    for (int k = 0; k < p; k++)
        for (int i = 0; i < p; i++)
            w->vectors[i + k * p] = (w->matrix[i + k * p] + w->matrix[k + i * p]) / 2;
    if (p > 0 && kmp_symmetric_eigen(p, w->vectors, w->values) != 0) {
        w->status = kmp_fail_memory(w->l->system->context);
        return false;
    }
    w->least = p > 0 ? w->values[0] : 1;
    w->flat = false;
    for (int k = 0; k < p; k++)
        w->flat = w->flat || fabs(w->values[k]) <= KMP_WAY_FLAT;
    return true;
}

/* The step in w->step by the matrix. False: it has none. */
static bool solve(kmp_descent *w)
{
    int p = w->count;
    double *factors = w->factors;
    memcpy(factors, w->matrix, (size_t)(p * p) * sizeof *factors);
    if (p > 0 && kmp_lu_factor(p, factors, w->pivot))
        return false;
    for (int k = 0; k < p; k++)
        w->step[k] = -w->right[k];
    kmp_lu_solve(p, factors, w->pivot, 1, w->step);
    return true;
}

/* The descent step in w->step. It is Newton's where the symmetric part of Kr is positive or, if any balance is
 * accepted, where it descends. Otherwise it is that of a heavily damped motion. */
static bool find_direction(kmp_descent *w)
{
    for (int k = 0; k < w->count; k++)
        w->right[k] = w->force[w->place[k]] * w->size[k];
    if (!w->search->balanced || w->flat || !solve(w) || !(kmp_dot(w->count, w->step, w->right) < 0)) {
        /* Makes the symmetric part positive; along flat directions without force the step is zero. */
        int p = w->count;
        for (int k = 0; k < p; k++) {
            const double *v = w->vectors + k * p;
            double value = w->values[k], pull = fabs(kmp_dot(p, v, w->right)), wanted = value;
            if (value < -KMP_WAY_FLAT)
                wanted = -value;
            else if (fabs(value) <= KMP_WAY_FLAT)
                wanted = pull > KMP_WAY_BALANCED ? KMP_WAY_FLAT : 1;
            for (int j = 0; wanted != value && j < p; j++)
                for (int i = 0; i < p; i++)
                    w->matrix[i + j * p] += (wanted - value) * v[i] * v[j];
        }
        if (!solve(w))
            return false;
    }
    for (int k = 0; k < w->count; k++)
        w->step[k] *= w->size[k];
    return true;
}

/* -- steps ----------------------------------------------------------------------------------------------- */

static void shorten(kmp_descent *w, double factor)
{
    for (int i = 0; i < w->n; i++)
        w->move[i] *= factor;
    for (int k = 0; k < w->count; k++)
        w->step[k] *= factor;
}

/* s'R of the step, of some R. */
static double work_along(const kmp_descent *w, const double *residual)
{
    double sum = 0;
    for (int k = 0; k < w->count; k++)
        sum += w->step[k] * residual[w->place[k]];
    return sum;
}

/* Distance of contact i after a part of the step. */
static double distance_after(kmp_descent *w, double part, int i)
{
    bool there = kmp_descent_try(w, part);
    kmp_contact_set_look(w->contacts, w->t, w->l->q);
    return there ? w->contacts->gap[i] : -INFINITY;
}

/* The part of the step, from 0 on, at which contact i closes; it overlaps after `part`. */
static double part_to(kmp_descent *w, double part, int i)
{
    double x, far = w->contacts->gap[i];
    kmp_contact_set_look(w->contacts, w->t, w->q);
    double near = w->contacts->gap[i];
    if (near <= 0)
        return 0;
    kmp_bracket bracket = kmp_bracket_of(0, near, part, far);
    while (kmp_bracket_next(&bracket, FINE * part, &x)) {
        double gap = distance_after(w, x, i);
        kmp_bracket_take(&bracket, x, gap, gap < 0);
    }
    (void)distance_after(w, bracket.near, i);
    return bracket.near;
}

/* Shortens the step to the first surface that it meets; the contact is w->contacts->struck. */
static double cut(kmp_descent *w, double part)
{
    kmp_contact_set *contacts = w->contacts;
    if (!contacts)
        return part;
    contacts->struck = -1;
    kmp_contact_set_look(contacts, w->t, w->l->q);
    for (int i = kmp_contact_set_overlap(contacts); i >= 0 && part > 0; i = kmp_contact_set_overlap(contacts)) {
        contacts->struck = i;
        part = part_to(w, part, i);
    }
    return part;
}

static bool strikes(const kmp_descent *w)
{
    return w->contacts && w->contacts->struck >= 0;
}

/* The part of the step at which the work has fallen to half or still decreases, or at which surfaces meet. 0: none, or
 * they do at once. */
static double search_line(kmp_descent *w)
{
    double first = work_along(w, w->force), part = 1;
    for (int k = 0; k < MOST_HALVINGS; k++) {
        if (!kmp_descent_try(w, part)) {
            part /= 2;
            continue;
        }
        part = cut(w, part);
        if (part == 0)
            return 0;
        double last = work_along(w, w->l->residual);
        if (last <= 0.5 * fabs(first))
            return part;
        part *= fmax(0.1, fmin(0.8, first / (first - last)));
    }
    return 0;
}

/* -- from afar --------------------------------------------------------------------------------------- */

/* The coordinate with the longest path, and its length. */
static int farthest(const kmp_descent *w, double *far)
{
    int best = 0;
    *far = 0;
    for (int k = 0; k < w->l->p; k++) {
        int c = w->l->part.u[k];
        double size = fabs(w->q[c] - w->begin[c]) / w->l->system->scale[c];
        if (size > *far) {
            *far = size;
            best = k;
        }
    }
    return best;
}

/* Reports the forces at the start along coordinate u[k], which has moved so far since. */
static kempe_status complain_runaway(kmp_descent *w, int k, double far)
{
    kmp_linear *l = w->l;
    int coordinate = l->part.u[k], place = -1;
    const kmp_motion *motion = &l->system->model->motions[coordinate];
    kmp_shown as = kmp_shown_as(l->system->context, motion->rotation ? "rad" : "m");
    kmp_text pulls = {0};
    if (!w->search->quiet && kmp_descent_at(w, w->begin))
        place = kmp_linear_place(l, coordinate);
    KMP_TRY(place >= 0 ? kmp_load_path_report(&pulls, l, place) : KEMPE_OK);
    (void)kmp_fail(l->system->context, KEMPE_E_FAILED,
                   "no equilibrium: nothing restrains '%s', which moves by %.3g %s%s%s; no spring, stop or closure "
                   "gives a restoring force: add one, start nearer to an equilibrium, or hold it and solve for a load",
                   motion->name, as.factor * far * l->system->scale[coordinate], as.unit,
                   pulls.s ? "; forces along it at the start: " : "", pulls.s ? pulls.s : "");
    kmp_text_free(&pulls);
    return KEMPE_E_FAILED;
}

/* Aside along the direction in which Kr falls most. */
static bool push_aside(kmp_descent *w)
{
    int largest = 0;
    for (int k = 0; k < w->count; k++) {
        w->step[k] = w->vectors[k] * w->size[k];
        if (fabs(w->vectors[k]) > fabs(w->vectors[largest]))
            largest = k;
    }
    double far = kmp_descent_spread(w);
    shorten(w, (w->vectors[largest] < 0 ? -PUSH : PUSH) / far);
    for (int k = 0; k < MOST_HALVINGS; k++)
        if (kmp_descent_try(w, ldexp(1, -k)))
            return kmp_descent_arrive(w);
    return false;
}

/* Goes `far` along the current direction. */
static bool step_down(kmp_descent *w, double far)
{
    double wanted = far;
    if (!(far < HUGE_VAL))
        return false;
    if (far > w->bound) {
        shorten(w, w->bound / far);
        far = w->bound;
    }
    double part = search_line(w);
    if (strikes(w)) {
        if (part > 0)
            memcpy(w->q, w->l->q, (size_t)w->n * sizeof *w->q);
        w->contacts->closed[w->contacts->struck] = KMP_PRESSED;
        kmp_descent_note_step(w, part * far);
        return kmp_descent_press(w);
    }
    if (part == 0) {
        kmp_descent_take_rates(w);
        (void)kmp_descent_at(w, w->q);
        return false;
    }
    if (part == 1 && wanted > w->bound)
        w->bound = w->search->balanced ? fmin(2 * w->bound, LONGEST) : 2 * w->bound;
    else if (part < 1)
        w->bound = fmax(0.5 * w->bound, part * far);
    kmp_descent_note_step(w, part * far);
    return kmp_descent_arrive(w);
}

/* True if the search has converged. Stiff springs make every residual small: the step measures the distance. A start
 * that is already balanced is reported in any case. */
static bool is_there(const kmp_descent *w, double far)
{
    if (w->residual > KMP_WAY_BALANCED)
        return false;
    if (w->search->balanced)
        return true;
    bool stable = w->least >= -KMP_WAY_FLAT;
    return stable ? far <= (w->flat ? STILL : NEAR) : far <= STILL && w->search->iterations == 1;
}

static kempe_status descend(kmp_descent *w)
{
    int pushes = 0;
    double far;
    while (w->search->iterations < MOST_DOWN) {
        if (kmp_interrupted(w->l->system->context))
            return kmp_descent_complain(w, "interrupted");
        if (!decompose(w))
            return w->status;
        kmp_descent_note(w, w->residual);
        far = find_direction(w) ? kmp_descent_spread(w) : HUGE_VAL;
        if (is_there(w, far))
            return KEMPE_OK;
        bool balanced = w->residual <= KMP_WAY_BALANCED && far <= STILL;
        bool gone = balanced && pushes < MOST_PUSHES ? push_aside(w) : step_down(w, far);
        pushes += balanced;
        if (!gone)
            return w->status != KEMPE_OK ? w->status : kmp_descent_complain(w, "no step reduces the energy further");
        int k = farthest(w, &far);
        if (far > FARTHEST)
            return complain_runaway(w, k, far);
    }
    int k = farthest(w, &far);
    return far > RUNAWAY_TURNS ? complain_runaway(w, k, far) : kmp_descent_complain(w, "too many iterations");
}

/* Closes a contact that overlaps at the equilibrium, or opens one that pulls. *agrees: there is none. */
static kempe_status exchange_contact(kmp_descent *w, bool *agrees)
{
    *agrees = true;
    KMP_TRY(w->contacts ? kmp_contact_set_exchange(w->contacts, w->l, w->most, agrees) : KEMPE_OK);
    if (*agrees || kmp_descent_press(w))
        return KEMPE_OK;
    return w->status != KEMPE_OK ? w->status : kmp_descent_complain(w, "a contact cannot be closed");
}

static kempe_status find(kmp_descent *w)
{
    memcpy(w->begin, w->q, (size_t)w->n * sizeof *w->q);
    KMP_TRY(kmp_contact_set_begin(w->l, w->t, w->q, w->search->keeps, &w->arena, &w->contacts));
    (void)kmp_descent_center(w);
    KMP_TRY(kmp_descent_choose(w));
    if (!kmp_descent_at(w, w->q) || !kmp_descent_arrive(w))
        return w->status != KEMPE_OK ? w->status
                                     : kmp_fail(w->l->system->context, KEMPE_E_FAILED,
                                                "the equations cannot be evaluated at the start: loops that do not "
                                                "close, or numbers that are not finite");
    bool descends = !w->search->newton && !w->search->exchange, agrees = false;
    while (!agrees) {
        KMP_TRY(descends ? descend(w) : KEMPE_OK);
        KMP_TRY(kmp_descent_least(w));
        KMP_TRY(exchange_contact(w, &agrees));
    }
    return KEMPE_OK;
}

static kempe_status find_balance(kmp_linear *linear, double t, double *q, kmp_search *search)
{
    kmp_descent w = {.l = linear, .search = search, .t = t, .n = linear->n, .reported = NAN};
    w.bound = search->balanced ? SHORT_BOUND : FIRST_BOUND;
    search->iterations = search->exchanges = 0;
    kempe_status status = kmp_descent_init(&w) ? KEMPE_OK : kmp_fail_memory(linear->system->context);
    if (status == KEMPE_OK) {
        memcpy(w.q, q, (size_t)w.n * sizeof *q);
        status = find(&w);
        if (status == KEMPE_E_FAILED && kmp_interrupted(linear->system->context))
            status = KEMPE_STOPPED;
        search->residual = w.residual;
    }
    if (status == KEMPE_OK) {
        memcpy(q, w.q, (size_t)w.n * sizeof *q);
        /* The loads along held coordinates, of R = M qdd + C there. */
        for (int i = 0; i < search->rate_count; i++) {
            int k = kmp_linear_place(linear, search->rates[i].coordinate);
            search->rates[i].load = search->rates[i].how == KMP_RATE_HELD && k >= 0 ? linear->residual[k] : 0;
        }
    } else {
        kmp_descent_give_up(&w);
    }
    kmp_contact_set_end(w.contacts);
    kmp_arena_free(&w.arena);
    return status;
}

/* True where a descent that has failed says little about equilibria: states have no energy, and along forces that are
 * not conservative, as those of a full film, the energy falls without end. */
static bool may_be_missed(const kempe_model *model, const kmp_search *search)
{
    return model->state_count > 0 || (search->iterations >= MOST_DOWN && !search->exchange);
}

/* Descends with the states among the unknowns, where that fails by Newton's method from the start. If neither succeeds,
 * the descent gives the reason. */
static kempe_status find_with_states(kmp_linear *linear, double t, double *q, kmp_search *search, kmp_steady *rates)
{
    const kempe_model *model = linear->system->model;
    size_t given = (size_t)search->rate_count * sizeof *rates;
    kmp_search with = *search;
    kempe_status status = KEMPE_E_FAILED;
    char *why = NULL;
    with.rates = rates;
    with.rate_count += model->state_count;
    for (int attempt = search->newton; status == KEMPE_E_FAILED && attempt < 2; attempt++) {
        if (attempt > search->newton) {
            if (!may_be_missed(model, &with))
                break;
            why = kmp_strdup(kempe_context_message(model->context));
            kmp_context_clear(model->context);
        }
        if (given > 0)
            memcpy(rates, search->rates, given);
        /* States as rates to be found, from their start values, after the first `count` rates. */
        int count = search->rate_count;
        for (int k = 0; k < model->state_count; k++) {
            int motion = kmp_model_coordinates(model) + k;
            rates[count + k] =
                (kmp_steady){.coordinate = motion, .rate = model->start.qd[motion].value, .how = KMP_RATE_FREED};
        }
        with.newton = attempt == 1;
        status = find_balance(linear, t, q, &with);
    }
    if (status == KEMPE_E_FAILED && why) {
        kmp_context_clear(model->context);
        (void)kmp_fail(model->context, status, "%s", why);
    }
    kmp_free(why);
    if (given > 0)
        memcpy(search->rates, rates, given);
    with.rates = search->rates;
    with.rate_count = search->rate_count;
    with.newton = search->newton;
    *search = with;
    return status;
}

kempe_status kmp_equilibrium_find(kmp_linear *linear, double t, double *q, kmp_search *search)
{
    const kempe_model *model = linear->system->model;
    kmp_steady *rates = KMP_NEW(kmp_steady, search->rate_count + model->state_count + 1);
    kempe_status status =
        rates ? find_with_states(linear, t, q, search, rates) : kmp_fail_memory(linear->system->context);
    kmp_free(rates);
    return status;
}
