/* SPDX-License-Identifier: BSD-3-Clause */
/* The modes study: options by words, and results. */
#include "analyses/modes/modes_study.h"
#include "analyses/derivatives/sampled_motion.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "model/data/body.h"
#include "model/data/coordinates.h"
#include "model/data/parameter.h"
#include "model/read/loads.h"
#include "platform/platform.h"
#include "studies/simulate/flexible_doubts.h"
#include <math.h>
#include <string.h>

enum { USUAL_VALUES = 61, MOST_VALUES = 100000 };

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status read_orders(kempe_modes *m, const char *text)
{
    while (text && *text) {
        double value;
        size_t length = kmp_text_to_number(text, &value);
        if (length == 0 || (text[length] && text[length] != ',') || !(value > 0))
            return kmp_fail(m->system->context, KEMPE_E_ARGUMENT,
                            "orders are positive numbers such as 1,2,0.5, not '%s'", text);
        if (m->order_count == KMP_MOST_ORDERS)
            return kmp_fail(m->system->context, KEMPE_E_ARGUMENT, "at most %d orders", KMP_MOST_ORDERS);
        m->order[m->order_count++] = value;
        text += length + (text[length] == ',');
    }
    return KEMPE_OK;
}

/* Largest difference of two states, angles modulo a turn and lengths over the characteristic length; `at`: its
 * coordinate. */
static double apart(const kempe_system *system, const double *a, const double *b, int *at)
{
    double most = 0;
    for (int i = 0; i < system->n; i++) {
        double d = kmp_model_motion(system->model, i)->rotation ? remainder(a[i] - b[i], 2 * acos(-1))
                                                                : (a[i] - b[i]) / system->length;
        if (fabs(d) > most) {
            most = fabs(d);
            *at = i;
        }
    }
    return most;
}

/* Warns where the sweep passes the parameter's own value at another equilibrium than the one found there: the state
 * between two values is then far from both, measured by their distance. */
static void compare_with_own(const kempe_modes *m, double own)
{
    const kmp_locus *l = &m->locus;
    const kempe_system *s = m->system;
    for (int k = 0; k + 1 < l->reached; k++) {
        const double *low = l->q + (ptrdiff_t)k * s->n, *high = low + s->n;
        int i = 0;
        double step = apart(s, low, high, &i), away = fmin(apart(s, low, m->q, &i), apart(s, high, m->q, &i));
        if ((l->value[k] - own) * (l->value[k + 1] - own) > 0 || away <= KMP_OTHER_BRANCH * step + KMP_SAME_STATE)
            continue;
        kmp_shown as = kmp_shown_as(s->context, kmp_model_motion(s->model, i)->rotation ? "rad" : "m");
        kmp_log(s->context, KEMPE_LOG_WARNING,
                "the sweep follows the equilibrium at %s = %g, and passes the model's value %g at another one: '%s' is "
                "%.4g instead of %.4g %s; sweep from the model's value",
                m->name, l->value[0], own, kmp_model_motion(s->model, i)->name, as.factor * high[i],
                as.factor * m->q[i], as.unit);
        return;
    }
}

static kempe_status sweep(kempe_modes *m, const kmp_operating_family_options *options, const kmp_range *range)
{
    kempe_context *context = m->system->context;
    int count = range->count > 0 ? range->count : USUAL_VALUES;
    if (m->modes.moving == 0)
        return kmp_fail(context, KEMPE_E_FAILED,
                        "no modes can be followed, because there are no degrees of freedom: free a drive, or take a "
                        "state in which friction slips");
    if (count < 2 || count > MOST_VALUES || range->from == range->to)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "a sweep needs two ends and 2 to %d values, as in '%s=1:2:61'",
                        MOST_VALUES, range->name);
    if (!options->varies)
        KMP_TRY(kmp_range_fits_variable(m->system->model, "sweep", range));
    m->name = kmp_arena_printf(&m->arena, "%s%s", options->varies ? "qd." : "", range->name);
    double *values = KMP_ARENA_NEW(&m->arena, double, count);
    KMP_TRY(kmp_made(context, !m->arena.failed));
    for (int k = 0; k < count; k++)
        values[k] = kmp_range_value(range, k, count);
    kmp_operating_family *family = NULL;
    kmp_operating_family_options own = *options;
    own.name = options->varies ? NULL : m->name;
    own.spare = own.warned = true;
    KMP_TRY(kmp_operating_family_new(m->system, &own, &family));
    kempe_status status = kmp_locus_make(family, count, values, &m->locus);
    if (status == KEMPE_STOPPED) {
        /* Keeps a locus that is not complete, with its reason. */
        const kmp_locus *l = &m->locus;
        m->reason = kmp_arena_printf(&m->arena, "'%s' was swept from %g to %g: %s", m->name, l->value[0],
                                     l->value[l->reached > 0 ? l->reached - 1 : 0],
                                     kmp_interrupted(context) ? "interrupted" : kempe_context_message(context));
        status = m->reason ? KEMPE_STOPPED : kmp_fail_memory(context);
    }
    int parameter = own.name ? kmp_parameter_find(m->system->model, own.name) : -1;
    if (status >= 0 && parameter >= 0 && m->family->state->equilibrium)
        compare_with_own(m, kmp_model_parameter(m->system->model, parameter)->number.value);
    kmp_operating_family_free(family);
    return status;
}

static kempe_status vary(kempe_modes *m, const char *text, const kmp_operating_family_options *options)
{
    kmp_ranges ranges;
    kempe_status status;
    KMP_TRY(kmp_ranges_read(m->system->context, text, &ranges));
    if (ranges.count != 1)
        status = kmp_fail(m->system->context, KEMPE_E_ARGUMENT, "only one quantity can be swept, as in '%s=1:2:61'",
                          ranges.range[0].name);
    else
        status = sweep(m, options, &ranges.range[0]);
    kmp_ranges_free(&ranges);
    return status;
}

/* Checks options that depend on each other, then computes the modes. */
static kempe_status make_of(kempe_modes *m, const kempe_modes_options *options, kmp_operating_family_options *at,
                            const kmp_range *rate, int varies)
{
    kempe_context *context = m->system->context;
    if (rate && options->sweep)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "only one quantity can be swept: the rate of '%s', or the quantity of --sweep", rate->name);
    if (at->rate_count > 0 && at->word && strncmp(at->word, "equilibrium ", 12) == 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "rates are given twice: in the state '%s' and by --rates", at->word);
    if (at->rate_count > 0 && at->word && strcmp(at->word, "equilibrium") != 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "rates belong to an equilibrium, not to '%s': a start has the rates of the model", at->word);
    size_t n = (size_t)m->system->n;
    KMP_TRY(kmp_operating_family_new(m->system, at, &m->family));
    KMP_TRY(kmp_operating_family_go(m->family, 0, &m->modes));
    m->q = KMP_ARENA_NEW(&m->arena, double, n);
    m->qd = KMP_ARENA_NEW(&m->arena, double, n);
    KMP_TRY(kmp_made(m->system->context, !m->arena.failed));
    memcpy(m->q, m->family->state->q, n * sizeof *m->q);
    memcpy(m->qd, m->family->state->qd, n * sizeof *m->qd);
    kmp_doubt_deflection(m->system, m->q);
    if (options->sweep)
        return vary(m, options->sweep, at);
    if (!rate)
        return KEMPE_OK;
    at->varies = &at->rates[varies];
    return sweep(m, at, rate);
}

/* "equilibrium NAME=RATE,.." names rates, too. */
static const char *rates_of(const kempe_modes_options *options, const char **word)
{
    static const char begin[] = "equilibrium ";
    *word = options->at;
    if (options->rates || !options->at || strncmp(options->at, begin, strlen(begin)) != 0)
        return options->rates;
    *word = NULL;
    return options->at + strlen(begin);
}

static kempe_status make(kempe_modes *m, const kempe_modes_options *options)
{
    kmp_operating_family_options at = {.averaged = m->averaged, .slides = options->slide};
    const char *rates = rates_of(options, &at.word);
    kmp_ranges ranges = {0};
    int varies = -1, *wish = KMP_ARENA_NEW(&m->arena, int, m->system->n);
    KMP_TRY(kmp_made(m->system->context, wish));
    KMP_TRY(kmp_coordinates_read(m->system->model, "--independent", options->independent, wish, &at.wish_count));
    KMP_TRY(read_orders(m, options->orders));
    double frequency = options->highest;
    m->highest = frequency > 0 ? 2 * acos(-1) * frequency : INFINITY;
    KMP_TRY(frequency >= 0 ? KEMPE_OK
                           : kmp_fail(m->system->context, KEMPE_E_ARGUMENT,
                                      "the highest frequency of pictures must be positive, not %g Hz", frequency));
    KMP_TRY(rates ? kmp_ranges_read(m->system->context, rates, &ranges) : KEMPE_OK);
    kmp_steady *list;
    kempe_status status = kmp_steady_take(m->system->model, &ranges, &m->arena, &varies, &list);
    if (status == KEMPE_OK) {
        at.wish = wish;
        at.rates = list;
        at.rate_count = ranges.count;
        status = make_of(m, options, &at, varies >= 0 ? &ranges.range[varies] : NULL, varies);
    }
    kmp_ranges_free(&ranges);
    return status;
}

/* Small motions with delays begin in a past at rest, and have no samples. */
static kempe_status check_delays(const kempe_system *system, const kempe_modes_options *options)
{
    const kempe_model *model = system->model;
    if (kmp_samples_in(model))
        KMP_TRY(kmp_refuse_delays(model, "modes of models with samples", KMP_INSTEAD_OF_DELAY));
    if (options->at && strcmp(options->at, "start") == 0)
        KMP_TRY(
            kmp_refuse_delays(model, "modes at the start, whose past need not be at rest", "take --at equilibrium"));
    return KEMPE_OK;
}

kempe_status kempe_modes_new(const kempe_system *system, const kempe_modes_options *options, kempe_modes **modes)
{
    KMP_WANTED_BOTH(system, modes);
    KMP_OPTIONS(system->context, kempe_modes_options, options);
    double begin = kmp_cpu_now();
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_modes, m);
    kempe_status status = check_delays(system, options);
    if (status == KEMPE_OK)
        status = kmp_averaged_new(system, &m->averaged);
    m->system = kmp_averaged_system(m->averaged, system);
    if (status == KEMPE_OK)
        status = make(m, options);
    m->status = status = kmp_context_verdict(system->context, status);
    m->warnings = kmp_context_warnings(system->context);
    m->cpu_s = kmp_cpu_now() - begin;
    return KMP_GIVE_IF(kmp_is_complete(status) || (status == KEMPE_STOPPED && m->reason), status, modes, m,
                       kempe_modes_free);
}

KMP_FREES(kempe_modes, modes, kmp_modes_free(&modes->modes), kmp_locus_free(&modes->locus),
          kmp_operating_family_free(modes->family), kmp_averaged_free(modes->averaged), kmp_free(modes->warnings),
          kmp_arena_free(&modes->arena))

/* -- queries ----------------------------------------------------------------------------------------- */

KMP_GETTER(int kempe_modes_zero_count(const kempe_modes *m), m, m->modes.spectrum.zeros, 0)

int kempe_modes_is_unstable(const kempe_modes *m)
{
    KMP_GIVEN(m, 0);
    for (int k = 0; k < m->modes.count; k++)
        if (m->modes.spectrum.re[k] > kmp_modes_noise(&m->modes))
            return 1;
    return m->modes.spectrum.secular;
}
