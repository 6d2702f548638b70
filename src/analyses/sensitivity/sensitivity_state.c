/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensitivities at one state, a row each: of an equilibrium, of reactions there or at the start, and of modes, with
 * real and imaginary part, frequency and damping of each. */
#include "analyses/derivatives/state_sensitivity.h"
#include "analyses/derivatives/varied.h"
#include "analyses/equilibrium/operating.h"
#include "analyses/modes/eigenmodes.h"
#include "analyses/parts/unsupported.h"
#include "analyses/sensitivity/sensitivity_study.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

/* Derivatives at one state: the equilibrium or the start, and its sensitivities to the parameters. */
typedef struct state {
    kempe_sensitivity *s;
    const char *backend;
    kmp_operating *at; /* NULL: the start */
    kmp_slopes *slopes;
    kmp_sensitivity_equations varied; /* its linear equations are at the state, their matrices made */
    kmp_state_sensitivity sensitivity_of_state;
    kmp_arena arena;           /* of the arrays */
    double *q, *qd, *dq, *dqd; /* of the start: n, n, n x count */
    double *shown, *by;        /* values, and count derivatives per parameter */
} state;

/* -- the state --------------------------------------------------------------------------------------- */

/* The start with the accelerations that the equations give. */
static kempe_status take_start(state *x)
{
    kmp_linear *l = &x->varied.linear;
    KMP_TRY(kmp_sensitivity_equations_start(&x->varied, x->q, x->qd, x->dq, x->dqd));
    KMP_TRY(kmp_linear_choose(l, 0, x->q, NULL, 0));
    if (kmp_linear_at_rates(l, 0, x->q, x->qd, true) != KEMPE_OK)
        return kmp_fail(x->s->context, KEMPE_E_FAILED,
                        "the start has no accelerations: its closures are singular, or a coordinate moves no mass");
    return kmp_state_sensitivity_at(&x->sensitivity_of_state, l, x->slopes, KMP_KEEP_RATES, x->dq, x->dqd);
}

/* Warns of coordinates that nothing restrains at the equilibrium, where their start depends on the parameters. */
static kempe_status warn_of_unrestrained(const state *x)
{
    const kmp_linear *l = &x->varied.linear;
    const kmp_state_sensitivity *of = &x->sensitivity_of_state;
    const kempe_model *model = x->s->system->model;
    bool depends = model->start.goal_count > 0;
    kmp_arena arena = {0};
    kmp_text names = {0};
    double *start = KMP_ARENA_NEW(&arena, double, 2 * l->n);
    for (int k = 0; start && k < x->s->count && of->rank < l->p; k++) {
        (void)kmp_slopes_of_start(x->slopes, k, start, start + l->n);
        for (int i = of->rank; i < l->p; i++)
            depends = depends || start[l->part.u[of->c[i]]] != 0;
    }
    for (int i = of->rank; depends && i < l->p; i++)
        kmp_text_printf(&names, "%s'%s'", i > of->rank ? ", " : "", model->motions[l->part.u[of->c[i]]].name);
    if (names.s)
        kmp_log(x->s->context, KEMPE_LOG_WARNING,
                "no force restrains %s at the equilibrium: the place there follows from the start, which depends on "
                "parameters, and its derivatives are taken as zero",
                names.s);
    const bool made = start && !names.failed;
    kmp_text_free(&names);
    kmp_arena_free(&arena);
    return kmp_made(x->s->context, made);
}

static kempe_status take_equilibrium(state *x)
{
    kmp_linear *l = &x->varied.linear;
    KMP_TRY(kmp_operating_new(x->s->system, x->s->options->at, l, &x->at));
    if (x->at->held)
        return kmp_fail(x->s->context, KEMPE_E_FAILED,
                        "the speed of the steady motion is held by a load, whose derivatives are not supported; drive "
                        "the vehicle in the model (drives:), or vary a parameter by 'modes --sweep'");
    /* Rates that keep their start values are constants here: they must not change with a parameter. */
    int n = x->s->system->n;
    KMP_TRY(x->at->kept_count > 0 ? kmp_sensitivity_equations_start(&x->varied, x->q, x->qd, x->dq, x->dqd) : KEMPE_OK);
    for (int i = 0; i < x->at->kept_count; i++)
        for (int k = 0; k < x->s->count; k++)
            if (x->dqd[x->at->kept[i] + k * n] != 0)
                return kmp_fail(x->s->context, KEMPE_E_FAILED,
                                "the steady motion keeps the velocity of '%s', whose start value depends on '%s': such "
                                "derivatives are not supported; omit the parameter, or vary it by 'modes --sweep'",
                                x->s->system->model->motions[x->at->kept[i]].name, x->s->name[k]);
    KMP_TRY(kmp_operating_take(x->at, l, NULL, 0));
    KMP_TRY(kmp_averaged_judge(x->s->averaged, l));
    memcpy(x->q, x->at->q, (size_t)l->n * sizeof *x->q);
    memcpy(x->qd, x->at->qd, (size_t)l->n * sizeof *x->qd);
    KMP_TRY(kmp_state_sensitivity_at(&x->sensitivity_of_state, l, x->slopes, KMP_KEEP_EQUILIBRIUM, NULL, NULL));
    return warn_of_unrestrained(x);
}

/* Finds the requested state. KEMPE_E_ARGUMENT: there is no such word. KEMPE_E_FAILED, with the reason: there is no
 * such state, or it has no derivative. */
static kempe_status state_init(state *x, kempe_sensitivity *s, bool with_outputs)
{
    bool start = s->options->at && strcmp(s->options->at, "start") == 0;
    *x = (state){.s = s};
    const kmp_backend *backend = kmp_backend_choose(s->context, s->run->backend);
    if (!backend)
        return KEMPE_E_ARGUMENT;
    s->backend = x->backend = backend->name;
    KMP_TRY(kmp_slopes_new(s->system, x->backend, s->count, (const char *const *)s->name, with_outputs, &x->slopes));
    int n = s->system->n, count = s->count, shown = x->slopes->shown;
    KMP_TRY(kmp_made(s->context,
                     KMP_ARENA_MAKE(&x->arena, KMP_ROOM(double, n, &x->q, &x->qd),
                                    KMP_ROOM(double, n *count, &x->dq, &x->dqd), KMP_ROOM(double, shown, &x->shown),
                                    KMP_ROOM(double, shown *count, &x->by))));
    KMP_TRY(kmp_state_sensitivity_init(&x->sensitivity_of_state, s->system, s->count, (const char *const *)s->name));
    KMP_TRY(kmp_sensitivity_equations_init(&x->varied, s->system, x->backend, x->slopes));
    return start ? take_start(x) : take_equilibrium(x);
}

static void state_free(state *x)
{
    kmp_sensitivity_equations_free(&x->varied);
    kmp_state_sensitivity_free(&x->sensitivity_of_state);
    kmp_slopes_free(x->slopes);
    kmp_operating_free(x->at);
    kmp_arena_free(&x->arena);
    *x = (state){0};
}

/* -- the row ----------------------------------------------------------------------------------------- */

static kempe_status find_row(kempe_sensitivity *s)
{
    state x;
    kempe_status status = state_init(&x, s, true);
    if (status == KEMPE_OK && !kmp_sensitivity_choose(s))
        status = kmp_fail_memory(s->context);
    if (status == KEMPE_OK) {
        /* All additional outputs, with their derivatives: shown values per parameter. */
        kmp_instant at = kmp_linear_instant(&x.varied.linear);
        const kmp_state_sensitivity *sh = &x.sensitivity_of_state;
        const double *shown = kmp_slopes_values(&x.slopes->outputs, &at);
        if (x.slopes->shown)
            memcpy(x.shown, shown, (size_t)x.slopes->shown * sizeof *shown);
        for (int k = 0; k < x.s->count; k++) {
            kmp_direction along = {.q = sh->q + k * sh->n,
                                   .qd = sh->qd + k * sh->n,
                                   .qdd = sh->qdd + k * sh->n,
                                   .lambda = sh->lambda + k * sh->m};
            kmp_slopes_along(x.slopes, &x.slopes->outputs, &along, k, x.by + (size_t)k * (size_t)x.slopes->shown);
        }
        const kmp_linear *l = &x.varied.linear;
        double *row = kmp_sensitivity_add_row(s, 0);
        if (row)
            kmp_sensitivity_fill(s,
                                 &(kmp_sensitivity_source){{x.q, x.qd, l->qdd, l->lambda, x.shown},
                                                           {sh->q, sh->qd, sh->qdd, sh->lambda, x.by},
                                                           x.slopes->shown},
                                 row);
        status = row ? KEMPE_OK : kmp_fail_memory(s->context);
    }
    state_free(&x);
    return status;
}

/* -- the kinds --------------------------------------------------------------------------------------- */

/* The default outputs: coordinates, states and the loads that keep them, and the model's additional outputs. */
static void place_outputs(const kempe_model *model, kmp_text *words)
{
    kmp_text_printf(words, "q%s%s", model->state_count ? ",state" : "", model->closure_count ? ",lambda" : "");
    for (int o = 0; o < model->output_count; o++)
        if (kmp_output_rows[model->outputs[o].kind].width > 0) {
            kmp_text_put(words, ",");
            kmp_output_print(words, model, &model->outputs[o]);
        }
}

/* Forces of closures between points, multipliers of the others. */
static void reaction_outputs(const kempe_model *model, kmp_text *words)
{
    for (int c = 0; c < model->closure_count; c++)
        kmp_text_printf(words, "%s%s(%s)", c ? "," : "", model->closures[c].point[0] >= 0 ? "reaction" : "lambda",
                        model->closures[c].name);
}

static kempe_status find_equilibrium(kempe_sensitivity *s)
{
    if (s->options->at && strcmp(s->options->at, "start") == 0)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "the start is not an equilibrium: use 'reactions', 'modes' or 'trajectory' there");
    return find_row(s);
}

static kempe_status find_reactions(kempe_sensitivity *s)
{
    if (s->model->closure_count == 0 && !s->options->outputs)
        return kmp_fail(s->context, KEMPE_E_FAILED,
                        "the model has no closures and therefore no reactions: name outputs to differentiate");
    return find_row(s);
}

const kmp_sensitivity_kind kmp_sensitivity_equilibrium = {
    .name = "equilibrium", .find = find_equilibrium, .outputs = place_outputs, .rests = true};

const kmp_sensitivity_kind kmp_sensitivity_reactions = {
    .name = "reactions", .find = find_reactions, .outputs = reaction_outputs, .rests = true};

typedef struct work {
    kempe_sensitivity *s;
    const kmp_spectrum *spectrum;
    const kmp_mode_slopes *slopes;
    int *chosen, count; /* eigenvalues of the table: not exactly zero, of a pair the upper one */
} work;

enum { WORDS = 4 };

static int words_of(const work *w, int i)
{
    return w->spectrum->im[i] > 0 ? WORDS : 1;
}

static bool add_columns(work *w)
{
    static const char *const words[WORDS] = {"re", "im", "frequency", "damping"}, *const units[] = {"1/s", "1/s", "Hz",
                                                                                                    ""};
    bool ok = true;
    for (int k = 0; ok && k < w->count; k++)
        for (int c = 0; ok && c < words_of(w, w->chosen[k]); c++) {
            kmp_text name = {0};
            kmp_text_printf(&name, "mode.%d.%s", k + 1, words[c]);
            ok = !name.failed && kmp_sensitivity_add_column(w->s, name.s, units[c]);
            kmp_text_free(&name);
        }
    return ok;
}

/* frequency = im/(2 pi), damping = -re/|s|. */
static bool put_modes(work *w)
{
    const double turn = 2 * acos(-1.0);
    int count = w->s->count;
    double *value = kmp_sensitivity_add_row(w->s, 0), *slope = value ? value + w->s->columns : NULL;
    if (!value)
        return false;
    for (int k = 0; k < w->count; k++) {
        int i = w->chosen[k], words = words_of(w, i);
        double re = w->spectrum->re[i], im = w->spectrum->im[i], size = hypot(re, im);
        const double values[WORDS] = {re, im, im / turn, -re / size + 0};
        for (int p = 0; p < count; p++) {
            double dre = w->slopes->re[i * count + p], dim = w->slopes->im[i * count + p];
            double turned = re / size * (dim / size) - im / size * (dre / size); /* of the angle of s */
            const double d[WORDS] = {dre, dim, dim / turn, im / size * turned + 0};
            for (int c = 0; c < words; c++)
                slope[c * count + p] = d[c];
        }
        memcpy(value, values, (size_t)words * sizeof *value);
        value += words;
        slope += words * count;
    }
    return true;
}

/* "of modes 2, 3 .." */
static void list(const work *w, kmp_mode_kind kind, const char *what, kmp_text *note)
{
    int listed = 0;
    for (int k = 0; k < w->count; k++)
        if (w->slopes->kind[w->chosen[k]] == kind)
            kmp_text_printf(note, "%s%d", listed++ ? ", " : note->length ? "; of modes " : "of modes ", k + 1);
    if (listed)
        kmp_text_put(note, what);
}

static bool write_note(work *w)
{
    kmp_text note = {0};
    int zeros = w->spectrum->zeros;
    if (zeros)
        kmp_text_printf(&note, "%d eigenvalue%s exactly zero and omitted", zeros, zeros == 1 ? " is" : "s are");
    list(w, KMP_MODE_REPEATED, ", equal to others, the derivatives of all of them are given, sorted by size", &note);
    list(w, KMP_MODE_DEFECTIVE, ", equal to others with fewer vectors, no derivatives exist", &note);
    if (note.length)
        w->s->note = kmp_text_keep(&note, &w->s->arena);
    return !note.failed && !w->s->arena.failed;
}

/* Derivatives of the modes at the state x; the caller frees the intermediate results. */
static kempe_status find_modes(state *x, kempe_sensitivity *s, kmp_second_derivatives *second, kmp_spectrum *spectrum,
                               kmp_mode_slopes *slopes)
{
    KMP_TRY(state_init(x, s, false));
    KMP_TRY(kmp_second_derivatives_init(second, s->system, kmp_backend_find(x->backend), s->count,
                                        (const char *const *)s->name));
    KMP_TRY(kmp_linear_spectrum(&x->varied.linear, spectrum));
    KMP_TRY(kmp_mode_slopes_init(slopes, &x->varied.linear, second, &x->sensitivity_of_state, spectrum));
    work *w = &(work){.s = s, .spectrum = spectrum, .slopes = slopes};
    const kmp_spectrum *sp = w->spectrum;
    w->chosen = KMP_ARENA_NEW(&w->s->arena, int, sp->count);
    for (int i = sp->zeros; w->chosen && i < sp->count; i++)
        if (sp->im[i] >= 0)
            w->chosen[w->count++] = i;
    bool ok = w->chosen && add_columns(w) && put_modes(w) && write_note(w);
    return ok ? KEMPE_OK : kmp_fail_memory(w->s->context);
}

static kempe_status find_all_modes(kempe_sensitivity *s)
{
    state x = {0};
    kmp_second_derivatives second = {0};
    kmp_spectrum spectrum = {0};
    kmp_mode_slopes slopes = {0};
    if (s->options->outputs)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "sensitivities of modes are derivatives of eigenvalues: outputs cannot be chosen");
    KMP_TRY(kmp_refuse_load_dependent(s->system, "sensitivities of modes"));
    kempe_status status = find_modes(&x, s, &second, &spectrum, &slopes);
    kmp_mode_slopes_free(&slopes);
    kmp_spectrum_free(&spectrum);
    kmp_second_derivatives_free(&second);
    state_free(&x);
    return status;
}

const kmp_sensitivity_kind kmp_sensitivity_modes = {
    .name = "modes", .find = find_all_modes, .plain = true, .holds = true};
