/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction of a run: its elements, the site of a runner, sentences and log. */
#include "integrators/run/friction_run.h"
#include "constraints/closing/rounding.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/intended_rank.h"
#include "constraints/evaluation/load_multipliers.h"
#include "constraints/partition/partition.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/friction_modes.h"
#include "integrators/decide/run_start.h"
#include "integrators/friction/friction_elements.h"
#include "integrators/friction/friction_inside.h"
#include "integrators/friction/friction_problem.h"
#include "integrators/friction/shared_contacts.h"
#include "integrators/run/run.h"
#include "integrators/run/runner.h"
#include "integrators/run/runner_start.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/language/expression_value.h"
#include "model/read/loads.h"
#include <math.h>
#include <string.h>

/* Rows of elements that are held: which one was the last, whether independent rows are to be chosen again, and the
 * saddle system of the rows of a decision, which all its evaluations share. After most impacts the rows are those
 * before, and so are then the rows and coordinates of the formulation. */
struct kmp_held_rows {
    kmp_row_links links;
    int *row_of; /* by conditions that hold a row; -1: no coordinate moves it */
    int last;
    double *entry, *place, t;  /* non-zeros of J as if all elements held their rows, at a place (n) and time */
    double *mode, *entry_mode; /* by conditions: room for modes put aside */
    double *state;             /* 2 n: room for the state before a decision */
    double *row;               /* 3 n + m: room for a state between decisions */
    double *examined;          /* by conditions: values when contacts that share were examined last */
    bool known_examined;
    bool *out;   /* by rows: of an element that holds none now */
    bool placed; /* these are known */
    bool stale;
    kmp_shared_saddle saddle; /* of the rows that are chosen now */
    bool *chosen, known;      /* by conditions: it held a row when the event chose rows, which is so still */
    bool *before;             /* by conditions: it held a row before the decision */
    bool keeps;               /* a decision is being made: these are of the formulation before it */
    kmp_partition kept;       /* rows and coordinates, of the last formulation */
    kmp_shared_saddle with;   /* of these: as long as its rows stay, decisions share it */
    bool by_products;         /* the dynamics of the evaluator then */
};

void kmp_friction_release(kmp_runner *run)
{
    if (run->sticking.held)
        kmp_shared_saddle_free(&run->sticking.held->saddle);
}

kmp_shared_saddle *kmp_friction_saddle(const kmp_runner *run)
{
    return &run->sticking.held->saddle;
}

static bool holds(const kmp_runner *run, int condition)
{
    return run->s->events.condition[condition].role == KMP_ROLE_HELD && run->eval->conditions.mode[condition] != 0;
}

static bool holds_the_same(const kmp_runner *run, const bool *as)
{
    bool same = true;
    for (int k = 0; same && k < run->s->events.count; k++)
        same = holds(run, k) == as[k];
    return same;
}

void kmp_friction_drop_kept(kmp_runner *run)
{
    if (!run->sticking.held)
        return;
    kmp_shared_saddle_free(&run->sticking.held->with);
    kmp_partition_free(&run->sticking.held->kept);
    run->sticking.held->keeps = false;
}

void kmp_friction_end_decision(kmp_runner *run)
{
    run->sticking.held->keeps = false;
}

/* Takes the rows and coordinates of the formulation, which are those before the decision. */
static kempe_status take_kept(kmp_runner *run, double t, const double *q)
{
    kmp_friction_release(run);
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_made(run->s->context, kmp_partition_copy(&run->part, &run->sticking.held->kept)));
    kmp_eval_closure(run->eval, t, q);
    kmp_eval_drop(run->eval, run->part.m - run->part.r, run->part.redundant);
    return KEMPE_OK;
}

static kempe_status keep_rows(kmp_runner *run, double t, const double *q)
{
    struct kmp_held_rows *held = run->sticking.held;
    const kmp_partition *part = run->formulation->part;
    /* The saddle system that was made for the rows before serves where they are the same. */
    const bool same = held->with.made && held->by_products == run->eval->by_products && !run->eval->by_bodies &&
                      held->kept.r == part->r &&
                      (part->r == 0 || memcmp(held->kept.rows, part->rows, (size_t)part->r * sizeof *part->rows) == 0);
    if (same)
        kmp_partition_free(&held->kept);
    else
        kmp_friction_drop_kept(run);
    held->with.factored = false;
    held->by_products = run->eval->by_products;
    for (int k = 0; k < run->s->events.count; k++)
        held->before[k] = holds(run, k);
    held->keeps = kmp_partition_copy(&held->kept, part);
    return held->keeps ? take_kept(run, t, q) : kmp_fail_memory(run->s->context);
}

bool kmp_friction_holds_as_before(const kmp_runner *run)
{
    return run->sticking.held->keeps && holds_the_same(run, run->sticking.held->before);
}

kempe_status kmp_friction_release_rows(kmp_runner *run, double t, double *q, double *qd)
{
    struct kmp_held_rows *held = run->sticking.held;
    kmp_friction_forget_rows(run);
    if (run->formulation)
        KMP_TRY(keep_rows(run, t, q));
    if (run->sticking.impacts)
        KMP_TRY(held->keeps ? kmp_runner_project_by(run, t, q, qd, &held->with) : kmp_runner_project(run, t, q, qd));
    kmp_friction_let_go(run->sticking.friction);
    kmp_friction_release(run);
    kmp_partition_free(&run->part);
    KMP_TRY(kmp_runner_choose(run, t, q, -1, NULL, 0));
    for (int k = 0; k < run->s->events.count; k++)
        held->chosen[k] = holds(run, k);
    held->known = true;
    return KEMPE_OK;
}

/* -- the site -------------------------------------------------------------------------------------------- */

double kmp_friction_span(const kmp_runner *run)
{
    double span = kmp_run_span(&run->spec);
    return run->rate_scale > 0 ? fmin(span, KMP_FRICTION_SPAN / run->rate_scale) : span;
}

/* A dae meets rates, also rates of rows, only within the tolerance of its steps. */
static kmp_friction_numbers numbers(const void *self)
{
    const kmp_runner *run = self;
    double drift = run->method && run->method->dae ? KMP_FRICTION_DRIFT * run->spec.rtol : 0;
    return (kmp_friction_numbers){
        .span = kmp_friction_span(run), .rtol = run->spec.rtol, .still = fmax(KMP_FRICTION_STILL, drift)};
}

/* The rate of a motion that is not known yet. */
static double least_pace(const kmp_runner *run)
{
    return kmp_start_least_rate(kmp_run_span(&run->spec), kmp_system_gravity(run->s), run->s->length);
}

double kmp_friction_pace(const kmp_runner *run, const double *qd)
{
    const bool known = run->rate_scale > 1 / kmp_run_until(&run->spec); /* otherwise it is the rate of the span */
    double rate = fmax(known ? run->rate_scale : 0, least_pace(run));
    for (int i = 0; i < run->s->n; i++)
        rate = fmax(rate, fabs(qd[i]) / run->s->scale[i]);
    return rate;
}

static double pace(const void *self, const double *qd)
{
    return kmp_friction_pace(self, qd);
}

static void put(void *self, int condition, double input)
{
    kmp_runner *run = self;
    if (run->s->events.condition[condition].role == KMP_ROLE_HELD) {
        const int row = run->sticking.held->row_of[condition];
        run->sticking.held->last = input != 0 ? row : run->sticking.held->last;
        if (row >= 0)
            run->sticking.held->out[row] = input == 0;
    }
    if (run->eval->conditions.mode[condition] != input)
        kmp_eval_set_kink(run->eval, condition, input);
}

/* Rows are held one after the other, and chosen once they are needed. */
static int choose(void *self, double t, const double *q)
{
    kmp_runner *run = self;
    (void)t, (void)q;
    run->sticking.held->stale =
        run->sticking.held->stale || !run->sticking.held->known || !holds_the_same(run, run->sticking.held->chosen);
    return 0;
}

static int choose_now(kmp_runner *run, double t, const double *q)
{
    if (!run->sticking.held->stale)
        return 0;
    run->sticking.held->stale = run->sticking.held->known = false;
    kmp_friction_release(run);
    kmp_partition_free(&run->part);
    return (int)kmp_runner_choose(run, t, q, -1, NULL, 0);
}

/* The non-zeros of J as if all elements held their rows where they are. The levels of an element do not depend on
 * others. */
static const double *all_rows(kmp_runner *run, double t, const double *q)
{
    struct kmp_held_rows *held = run->sticking.held;
    const kempe_system *s = run->s;
    const size_t place = (size_t)s->n * sizeof *q, modes = (size_t)s->events.count * sizeof(double);
    if (held->placed && held->t == t && memcmp(held->place, q, place) == 0)
        return held->entry;
    memcpy(held->mode, run->eval->conditions.mode, modes);
    for (int i = 0; i < run->sticking.friction->count; i++) {
        const kmp_friction_element *e = &run->sticking.friction->element[i];
        const int slot = e->slot;
        kmp_eval_set_kink(run->eval, slot + KMP_ROLE_PLACE - KMP_ROLE_SENSE,
                          kmp_friction_at(run->sticking.friction, e, KMP_ROLE_PLACE));
        kmp_eval_set_kink(run->eval, slot + KMP_ROLE_HELD - KMP_ROLE_SENSE, 1);
    }
    kmp_eval_closure(run->eval, t, q);
    memcpy(held->entry, run->eval->jacobian, (size_t)s->jacobian.count * sizeof *held->entry);
    for (int k = 0; k < s->events.count; k++) {
        if (run->eval->conditions.mode[k] != held->mode[k])
            kmp_eval_set_kink(run->eval, k, held->mode[k]);
        if (s->events.condition[k].role == KMP_ROLE_HELD && held->row_of[k] >= 0)
            held->out[held->row_of[k]] = held->mode[k] == 0;
    }
    memcpy(held->place, q, place);
    held->t = t;
    held->placed = true;
    return held->entry;
}

void kmp_friction_forget_rows(kmp_runner *run)
{
    run->sticking.held->placed = false;
}

/* With rows that are redundant up to rounding of the model's numbers only the rank of the whole counts. */
static int adds_row(void *self, double t, const double *q, bool *adds)
{
    kmp_runner *run = self;
    if (!kmp_rounding_of(run->s)) {
        struct kmp_held_rows *held = run->sticking.held;
        *adds = false;
        if (held->last < 0)
            return 0;
        const double *entry = all_rows(run, t, q);
        return (int)kmp_partition_adds(run->s, entry, &held->links, held->out, held->last, KMP_FRICTION_RANK, adds);
    }
    KMP_FRICTION_TRY(choose_now(run, t, q));
    int rank = run->part.r;
    kmp_partition with;
    kmp_eval_closure(run->eval, t, q);
    kempe_status status = kmp_partition_init(&with, run->s, run->eval->jacobian, NULL, 0);
    if (status != KEMPE_OK)
        return (int)status;
    double before = rank > 0 ? run->part.pivots[rank - 1] : with.pivots[0];
    *adds = with.r > rank && with.pivots[with.r - 1] > KMP_FRICTION_RANK * before;
    kmp_partition_free(&with);
    return 0;
}

static int measure(void *self, double t, const double *q, const double *qd, double *change)
{
    kmp_runner *run = self;
    KMP_FRICTION_TRY(choose_now(run, t, q));
    kmp_eval_closure(run->eval, t, q);
    kempe_status status = kmp_runner_accelerate_by(run, t, q, qd, &run->sticking.held->saddle);
    if (status == KEMPE_OK)
        kmp_eval_all_changes(run->eval, t, q, qd, run->room.qdd, run->room.lambda, change);
    return (int)status;
}

static void rows(void *self, double t, const double *q, bool *known)
{
    kmp_runner *run = self;
    const kmp_shared_saddle *shared = &run->sticking.held->saddle;
    *known = shared->factored && shared->saddle.kind != KMP_SADDLE_BY_BODIES && run->s->load_row_count == 0;
    if (*known)
        kmp_eval_closure(run->eval, t, q);
}

static int column(void *self, int count, const int *row, int k, double *d)
{
    kmp_runner *run = self;
    const kempe_system *s = run->s;
    const kmp_row_links *links = &run->sticking.held->links;
    const double *jacobian = run->eval->jacobian;
    double *g = run->balance.row, *way = g + s->n;
    memset(g, 0, (size_t)s->n * sizeof *g);
    for (int e = links->row_start[row[k]]; e < links->row_start[row[k] + 1]; e++)
        g[s->jacobian.col[e]] = -jacobian[e];
    kmp_saddle_solve(&run->sticking.held->saddle.saddle, g, NULL, way, NULL);
    for (int i = 0; i < count; i++) {
        d[i] = 0;
        for (int e = links->row_start[row[i]]; e < links->row_start[row[i] + 1]; e++)
            d[i] += jacobian[e] * way[s->jacobian.col[e]];
    }
    return 0;
}

static void look(void *self, double t, const double *q, const double *qd, double *change)
{
    const kmp_runner *run = self;
    const double *now = kmp_eval_changes(run->eval, t, q, qd);
    memcpy(change, now, (size_t)run->s->events.count * sizeof *now);
}

static int finish(void *self, double t, double *q, double *qd, double *change)
{
    kmp_runner *run = self;
    const bool same = kmp_friction_holds_as_before(run);
    kmp_shared_saddle *shared = same ? &run->sticking.held->with : &run->sticking.held->saddle;
    KMP_FRICTION_TRY(same ? (int)take_kept(run, t, q) : choose_now(run, t, q));
    run->sticking.held->stale = run->sticking.held->known = false;
    kempe_status status = kmp_runner_project_by(run, t, q, qd, shared);
    if (status == KEMPE_OK)
        status = kmp_runner_accelerate_by(run, t, q, qd, shared);
    if (status == KEMPE_OK && change)
        kmp_eval_all_changes(run->eval, t, q, qd, run->room.qdd, run->room.lambda, change);
    kmp_friction_release(run);
    return (int)status;
}

static bool is_unsettled(const void *self)
{
    return kmp_is_unsettled(((const kmp_runner *)self)->eval);
}

static void forget(void *self)
{
    kmp_context_clear(((const kmp_runner *)self)->s->context);
}

static void forget_loads(void *self)
{
    kmp_load_forget(((kmp_runner *)self)->eval);
}

/* -- sentences ------------------------------------------------------------------------------------------- */

static const kmp_force *force_of(const kmp_runner *run, const kmp_friction_element *e)
{
    return run->s->events.condition[e->slot].of;
}

static const char *name_of(const kmp_runner *run, const kmp_friction_element *e)
{
    return force_of(run, e)->name;
}

void kmp_friction_put_spread(kmp_text *text, int n, const double *d)
{
    double spread = 0; /* the largest ratio of inertias between directions of two rows; 0 where they are dependent */
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++) {
            double a = d[i + i * n], c = d[j + j * n], b = d[i + j * n], sum = a + c, rest = a * c - b * b;
            if (rest > KMP_SAME_ROW * sum * sum)
                spread = fmax(spread, sum * sum / rest);
        }
    if (spread > KMP_INERTIA_SPREAD)
        kmp_text_printf(text,
                        "; the inertia at its surface differs by the factor %.2g between directions: give the body a "
                        "larger moment of inertia",
                        spread);
}

static void put_cause(kmp_text *text, const kmp_runner *run)
{
    static const char *const causes[] = {
        [KMP_FRICTION_LEVELS] = "the friction levels depend too strongly on the friction forces to settle",
        [KMP_FRICTION_ROUNDED] = "the friction force cannot be found because of rounding",
        [KMP_FRICTION_REVERSES] = "sliding friction would reverse the slip as it begins",
        [KMP_FRICTION_LOADS] =
            "forces that depend on constraint forces have no solution in the next state of slip and stick"};
    const kmp_friction_run *x = run->sticking.friction;
    bool across = false;
    for (int k = 0; k < x->rest; k++)
        across = across || x->element[x->which[k]].twin >= 0;
    if (x->growth >= 1)
        kmp_text_printf(
            text, ": the level of '%s' grows by %.4g for each unit of friction, and only below 1 a solution is certain",
            name_of(run, &x->element[x->most]), x->growth);
    else
        kmp_text_printf(text, ": %s", causes[x->cause]);
    if (x->tried_modes == 0 && across)
        kmp_text_put(text, ", and combinations of slip in two directions cannot be tried one by one");
    else if (x->tried_modes == 0)
        kmp_text_printf(text, ", and %d friction elements have too many combinations of slip and stick to try",
                        x->rest);
    else if (x->cause != KMP_FRICTION_LOADS)
        kmp_text_printf(text, ", and none of %d combinations of slip and stick agrees with the forces", x->tried_modes);
}

static kempe_status fail_impossible(const kmp_runner *run, double t)
{
    const kmp_friction_run *x = run->sticking.friction;
    kmp_text text = {0};
    for (int i = 0; i < x->count; i++)
        if (!x->element[i].contact && (x->rest == 0 || x->element[i].tries))
            kmp_text_printf(&text, "%s'%s'", text.length ? ", " : "", name_of(run, &x->element[i]));
    kmp_text_printf(&text, " can neither slip nor stick at t = %.9g s", t);
    put_cause(&text, run);
    kmp_friction_put_spread(&text, x->rest, x->d);
    kmp_text_put(&text,
                 x->rest > 0 ? ". Reduce the friction, or regularise it with a 'speed'" : ". Reduce the friction");
    return kmp_fail_text(run->s->context, KEMPE_E_FAILED, &text);
}

static kempe_status fail_alternating(const kmp_runner *run, double t)
{
    const kmp_friction_run *x = run->sticking.friction;
    const kmp_friction_element *most = x->element;
    for (int i = 0; i < x->count; i++)
        most = x->element[i].changes > most->changes ? &x->element[i] : most;
    const kmp_friction_element *contact = most->base >= 0 ? &x->element[most->base] : most;
    const char *help = contact->contact ? "A 'law' makes this contact compliant, and its forces unique"
                                        : "Regularise this friction with a 'speed'";
    bool at_once = x->past.repeats >= KMP_FRICTION_REPEATS;
    return kmp_fail(
        run->s->context, KEMPE_E_FAILED,
        "slip and stick changed %d times between t = %.9g and %.9g s without an end, most often at '%s'. %s",
        at_once ? x->past.repeats : x->past.changes, at_once ? t : x->past.since, t, name_of(run, most), help);
}

static kempe_status fail_locked(const kmp_runner *run, bool jams, double t)
{
    const kmp_friction_run *x = run->sticking.friction;
    const kmp_friction_element *e = &x->element[x->locked];
    const char *side = e->unlimited > 0 ? "positive" : "negative";
    if (jams)
        return kmp_fail(run->s->context, KEMPE_E_FAILED,
                        "friction '%s' is unlimited against %s rates, and the closures turn it into this direction at "
                        "t = %.9g s, with an impact that is not computed",
                        name_of(run, e), side, t);
    return kmp_fail(run->s->context, KEMPE_E_FAILED,
                    "friction '%s' is unlimited against %s rates, but its rate is %.6g at t = %.9g s: it does not stop "
                    "starts and jumps of rates",
                    name_of(run, e), side, kmp_friction_at(x, e, KMP_ROLE_RATE), t);
}

static int fail(void *self, kmp_friction_failure failure, double t)
{
    const kmp_runner *run = self;
    switch (failure) {
    case KMP_FRICTION_IMPOSSIBLE:
        return (int)fail_impossible(run, t);
    case KMP_FRICTION_ALTERNATES:
        return (int)fail_alternating(run, t);
    case KMP_FRICTION_LOCKED:
    case KMP_FRICTION_JAMMED:
        return (int)fail_locked(run, failure == KMP_FRICTION_JAMMED, t);
    case KMP_FRICTION_FORCED:
        return (int)kmp_fail(run->s->context, KEMPE_E_FAILED,
                             "the closures or drives press the surfaces of contacts into each other at t = %.9g s", t);
    default:
        return (int)kmp_fail(
            run->s->context, KEMPE_E_FAILED,
            "no state of slip and stick is found at t = %.9g s: forces of %d nearly redundant elements "
            "follow from rounding. Leave some out, or take a 'law'",
            t, run->sticking.friction->rest);
    }
}

static const char *words_of(const kmp_friction_element *e, const kmp_contact_words *contact)
{
    switch (e->stance) {
    case KMP_FRICTION_SLIPS:
        if (e->contact)
            return contact->ends;
        if (e->twin >= 0)
            return "slips";
        return e->sense > 0 ? "slips forward" : "slips backward";
    case KMP_FRICTION_SMOOTH:
        return "is regularised: no combination of slip and stick is possible, or several are";
    case KMP_FRICTION_IDLE:
        return "is held at rest by other closures: its force is not unique, and is taken as zero";
    default:
        return e->contact ? contact->begins : "sticks";
    }
}

void kmp_mark_contact(const kempe_system *system, int slot, kmp_role role)
{
    atomic_store_explicit(&system->left[slot + (int)role - KMP_ROLE_SENSE], true, memory_order_relaxed);
}

/* Contacts, or ropes, that share loads, of which the motion depends on how if `felt`. */
static void report_shared(const kmp_runner *run, const char *what, double t, bool felt)
{
    static const char *const words = "the %s of redundant %s are not unique, and one solution is shown: %s";
    const kempe_model *model = run->s->model;
    const kmp_friction_run *x = run->sticking.friction;
    kmp_text names = {0};
    bool shown = false, ropes = true, contacts = true, marked = false;
    for (int i = 0; i < x->count; i++)
        if (x->element[i].shares) {
            if (!marked && x->element[i].contact) /* one of them, for the ensemble of this run */
                kmp_mark_contact(run->s, x->element[i].slot, felt ? KMP_ROLE_SENSE : KMP_ROLE_HELD);
            marked = marked || x->element[i].contact;
            const char *name = name_of(run, &x->element[i]);
            ropes = ropes && strcmp(kmp_contact_words_of(model, name).noun, "rope") == 0;
            contacts = contacts && x->element[i].contact;
            kmp_text_printf(&names, "%s'%s'", names.length ? ", " : "", name);
        }
    if (names.failed)
        return;
    const char *noun = ropes ? "ropes" : contacts ? "contacts" : "contacts and friction";
    for (int k = 0; k < model->output_count; k++)
        shown = shown || kmp_output_has_loads(model, &model->outputs[k]);
    kmp_run_log_add(run->log, "shared load", t, NAN, NAN, words, what, noun, names.s);
    if (felt)
        kmp_doubt(run->s->context,
                  "friction makes the motion depend on the %s of redundant %s at t = %.9g s, which are not unique: %s. "
                  "Use fewer of these, or a compliant 'law'",
                  what, noun, t, names.s);
    else if (shown)
        kmp_log(run->s->context, KEMPE_LOG_WARNING, words, what, noun, names.s);
    kmp_text_free(&names);
}

static void report(void *self, kmp_friction_fact fact, int element, double t, double number)
{
    const kmp_runner *run = self;
    if (fact == KMP_FRICTION_FACT_SHARED || fact == KMP_FRICTION_FACT_SHARED_IMPULSES) {
        report_shared(run, fact == KMP_FRICTION_FACT_SHARED ? "forces" : "impulses", t, number > 0);
        return;
    }
    const kmp_friction_element *e = element < 0 ? NULL : &run->sticking.friction->element[element];
    if (!e) {
        kmp_run_log_add(
            run->log, "solutions", t, number, NAN,
            "%d combinations of slip and stick are possible; the run continues with the one nearest to the last",
            (int)number);
    } else if (fact == KMP_FRICTION_FACT_CHANGE) {
        const kmp_friction_element *named = e->twin < 0 ? e : &run->sticking.friction->element[e->base];
        const kmp_contact_words words = kmp_contact_words_of(run->s->model, name_of(run, named));
        const bool rope = e->contact && strcmp(words.noun, "rope") == 0;
        kmp_run_log_add(run->log, e->contact ? "contact" : "friction", t, e->before_sense, e->sense, "%s'%s%s' %s",
                        rope ? "rope " : "", name_of(run, named), e->twin < 0 ? "" : "_friction", words_of(e, &words));
    } else if (fact == KMP_FRICTION_FACT_LEFT) {
        kmp_run_log_add(run->log, "regularised", t, e->smooth_t, number, "'%s' was regularised from t = %.9g to %.9g s",
                        name_of(run, e), e->smooth_t, t);
    } else {
        kmp_run_log_add(run->log, "growth", t, NAN, number,
                        "the level of '%s' grows by %.4g for each unit of friction: from 1 on there may be several "
                        "solutions, or none",
                        name_of(run, e), number);
    }
}

/* -- making ---------------------------------------------------------------------------------------------- */

int kmp_friction_elements(const kmp_events *events)
{
    int count = 0;
    for (int k = 0; k < events->count; k++)
        count += events->condition[k].role == KMP_ROLE_SENSE;
    return count;
}

static const kmp_force *force_at(const kmp_events *events, const kmp_friction_element *e)
{
    return events->condition[e->slot].of;
}

/* The element of a force; -1: none. */
static int element_with(const kmp_events *events, int count, const kmp_friction_element *element,
                        const kmp_force *force)
{
    for (int i = 0; i < count; i++)
        if (force_at(events, &element[i]) == force)
            return i;
    return -1;
}

static void take_numbers(const kempe_system *s, const kmp_events *events, int count, kmp_friction_element *element)
{
    for (int i = 0; i < count; i++) {
        kmp_friction_element *e = &element[i];
        const kmp_force *force = force_at(events, e);
        int row = 0;
        while (row < s->m && s->rows[row].closure != force->closure)
            row++;
        e->row = row < s->m ? row : 0;
        e->size = row < s->m ? s->row_scale[row] : 1;
        e->regularise = force->has_regularise ? force->regularise.value : 0;
    }
}

void kmp_friction_list(const kempe_system *s, const kmp_events *events, kmp_friction_element *element)
{
    int count = 0;
    for (int k = 0; k < events->count; k++) {
        const kmp_force *force = events->condition[k].of;
        if (events->condition[k].role == KMP_ROLE_SENSE)
            element[count++] = (kmp_friction_element){.slot = k,
                                                      .contact = force->kind == KMP_FORCE_TOUCH,
                                                      .across = force->across,
                                                      .loaded = kmp_force_lambda(force),
                                                      .sides = kmp_force_has_sides(force),
                                                      .unlimited = kmp_force_unlimited(force)};
    }
    for (int i = 0; i < count; i++) {
        const kmp_force *force = force_at(events, &element[i]);
        const kmp_force *contact = force->contact > 0 ? kmp_model_force(s->model, force->contact - 1) : NULL;
        element[i].base = contact ? element_with(events, count, element, contact) : -1;
        element[i].twin = force->across > 0 ? element_with(events, count, element, kmp_friction_twin(force)) : -1;
    }
    take_numbers(s, events, count, element);
}

/* Makes the list of rows that conditions hold. False: no memory. */
static bool find_held_rows(kmp_runner *run, const kmp_friction_run *x)
{
    const kempe_system *s = run->s;
    struct kmp_held_rows *held = run->sticking.held = KMP_ARENA_NEW(&run->arena, struct kmp_held_rows, 1);
    if (!held || !kmp_row_links_init(&held->links, s, &run->arena) ||
        !KMP_ARENA_MAKE(&run->arena, KMP_ROOM(int, s->events.count, &held->row_of),
                        KMP_ROOM(bool, s->events.count, &held->before, &held->chosen), KMP_ROOM(bool, s->m, &held->out),
                        KMP_ROOM(double, s->jacobian.count, &held->entry), KMP_ROOM(double, s->n, &held->place),
                        KMP_ROOM(double, s->events.count, &held->mode, &held->entry_mode),
                        KMP_ROOM(double, 2 * s->n, &held->state), KMP_ROOM(double, 3 * s->n + s->m, &held->row),
                        KMP_ROOM(double, s->events.count, &held->examined)))
        return false;
    for (int i = 0; i < x->count; i++) {
        const kmp_friction_element *e = &x->element[i];
        const bool moves = e->row < s->m && s->rows[e->row].closure == force_at(&s->events, e)->closure;
        held->row_of[e->slot + KMP_ROLE_HELD - KMP_ROLE_SENSE] = moves ? e->row : -1;
    }
    return true;
}

void kmp_friction_renew(kmp_runner *run)
{
    if (run->sticking.friction)
        take_numbers(run->s, &run->s->events, run->sticking.friction->count, run->sticking.friction->element);
}

kmp_friction_run *kmp_friction_new(kmp_runner *run, bool *none)
{
    const kmp_events *events = &run->s->events;
    kmp_arena *a = &run->arena;
    kmp_friction_run *x = KMP_ARENA_NEW(a, kmp_friction_run, 1);
    kmp_friction_site *site = KMP_ARENA_NEW(a, kmp_friction_site, 1);
    const int count = kmp_friction_elements(events);
    *none = count == 0;
    if (!x || !site || *none)
        return NULL;
    if (!KMP_ARENA_MAKE(a, KMP_ROOM(kmp_friction_element, count, &x->element, &x->kept_element),
                        KMP_ROOM(int, count, &x->which, &x->side, &x->partner, &x->rows),
                        KMP_ROOM(double, events->count, &x->change), KMP_ROOM(double, count *count, &x->d),
                        KMP_ROOM(double, kmp_sharing_room(count), &x->room),
                        KMP_ROOM(double, count, &x->a, &x->lower, &x->upper, &x->under, &x->f, &x->y, &x->tried,
                                 &x->aside, &x->found)))
        return NULL;
    *site = (kmp_friction_site){.self = run,
                                .failed = KEMPE_E_FAILED,
                                .numbers = numbers,
                                .pace = pace,
                                .put = put,
                                .choose = choose,
                                .adds = adds_row,
                                .measure = measure,
                                .rows = rows,
                                .column = column,
                                .look = look,
                                .finish = finish,
                                .is_unsettled = is_unsettled,
                                .forget = forget,
                                .forget_loads = forget_loads,
                                .fail = fail,
                                .report = report};
    x->site = site;
    x->loads = kmp_friction_is_loaded(run->s->model);
    x->count = count;
    x->n = run->s->n;
    kmp_friction_list(run->s, events, x->element);
    kmp_friction_begin(x);
    return find_held_rows(run, x) ? x : NULL;
}

size_t kmp_friction_memory_size(const kmp_events *events)
{
    size_t count = (size_t)kmp_friction_elements(events);
    return count > 0 ? count * sizeof(kmp_friction_element) + sizeof(kmp_friction_past) : 0;
}

int kmp_friction_memory(kmp_friction_run *x, kmp_memory_piece *piece)
{
    if (!x)
        return 0;
    piece[0] = (kmp_memory_piece){x->element, (size_t)x->count * sizeof *x->element};
    piece[1] = (kmp_memory_piece){&x->past, sizeof x->past};
    return 2;
}

bool kmp_friction_is_loaded(const kempe_model *model)
{
    bool loaded = false;
    for (int k = 0; k < kmp_model_force_count(model); k++) {
        const kmp_force *force = kmp_model_force(model, k);
        loaded = loaded || force->contact > 0 || (kmp_force_sticks(force) && kmp_force_lambda(force));
    }
    return loaded;
}

bool kmp_friction_is_smooth(const kmp_friction_run *x)
{
    bool any = false;
    for (int i = 0; x && i < x->count; i++)
        any = any || x->element[i].smooth;
    return any;
}

bool kmp_friction_feels_sharing(const kmp_friction_run *x)
{
    return x && x->past.felt;
}

/* -- in a run ---------------------------------------------------------------------------------------------- */

kempe_status kmp_friction_settle(kmp_runner *run, double t, double *q, double *qd)
{
    kmp_friction_forget_rows(run);
    return (kempe_status)kmp_friction_settle_modes(run->sticking.friction, t, q, qd);
}

kempe_status kmp_friction_settle_changed(kmp_runner *run, double t, double *q, double *qd)
{
    run->sticking.friction->kept = run->sticking.held->state;
    const kempe_status status = kmp_friction_settle(run, t, q, qd);
    run->sticking.friction->kept = NULL;
    return status;
}

/* True if forces, levels or rates of elements have changed since they were examined; notes them. */
static bool has_changed(kmp_runner *run)
{
    static const kmp_role roles[] = {KMP_ROLE_GIVEN, KMP_ROLE_STATIC, KMP_ROLE_RATE};
    const kmp_friction_run *x = run->sticking.friction;
    struct kmp_held_rows *held = run->sticking.held;
    bool changed = !held->known_examined;
    for (int r = 0; r < 3; r++) {
        double most = 0, off = 0;
        for (int i = 0; i < x->count; i++) {
            const double now = kmp_friction_at(x, &x->element[i], roles[r]),
                         then = held->examined[x->element[i].slot + (int)roles[r] - KMP_ROLE_SENSE];
            most = fmax(most, fmax(fabs(now), fabs(then)));
            off = fmax(off, fabs(now - then));
        }
        changed = changed || off > KMP_SHARED_CHANGED * most;
    }
    held->known_examined = true;
    if (changed)
        memcpy(held->examined, x->change, (size_t)run->s->events.count * sizeof *held->examined);
    return changed;
}

/* Examines a state with separate rows; modes, inputs and rows are then as before. */
static kempe_status examine(kmp_runner *run, double t, const double *q, const double *qd)
{
    kmp_friction_run *x = run->sticking.friction;
    struct kmp_held_rows *held = run->sticking.held;
    const int count = run->s->events.count;
    const kmp_partition part = run->part;
    const kmp_shared_saddle saddle = held->saddle;
    const bool known = held->known, stale = held->stale;
    double *mode = held->entry_mode;
    memcpy(mode, run->eval->conditions.mode, (size_t)count * sizeof *mode);
    memcpy(x->kept_element, x->element, (size_t)x->count * sizeof *x->element);
    run->part = (kmp_partition){0};
    held->saddle = (kmp_shared_saddle){.made = false};
    held->known = held->placed = false;
    held->stale = true;
    kempe_status status = (kempe_status)kmp_friction_examine(x, t, q, qd);
    for (int i = 0; i < x->count; i++)
        x->kept_element[i].shares = x->element[i].shares;
    memcpy(x->element, x->kept_element, (size_t)x->count * sizeof *x->element);
    for (int k = 0; k < count; k++)
        put(run, k, mode[k]);
    kmp_friction_release(run);
    kmp_partition_free(&run->part);
    run->part = part;
    held->saddle = saddle;
    held->known = known;
    held->stale = stale;
    held->placed = false;
    kmp_eval_closure(run->eval, t, q);
    kmp_eval_drop(run->eval, part.m - part.r, part.redundant);
    if (status == KEMPE_E_FAILED) /* an event that follows decides */
        forget(run);
    return status == KEMPE_E_FAILED ? KEMPE_OK : status;
}

kempe_status kmp_friction_watch_shared(kmp_runner *run, double t)
{
    const kmp_friction_run *x = run->sticking.friction;
    const int n = run->s->n;
    if (!x || !kmp_friction_may_share(x))
        return KEMPE_OK;
    double *row = run->sticking.held->row;
    KMP_TRY(kmp_runner_look_inside(run, t, true, row));
    kmp_eval_all_changes(run->eval, t, row, row + n, row + 2 * n, row + 3 * n, x->change);
    return has_changed(run) ? examine(run, t, row, row + n) : KEMPE_OK;
}

void kmp_friction_show(kmp_runner *run, double t, double *row)
{
    const int n = run->s->n;
    kmp_eval_show_friction(run->eval, t, row, row + n, row + 2 * n, row + 3 * n, run->sticking.friction->change);
}
