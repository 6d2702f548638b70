/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes as text, JSON, tables and a picture. */
#include "analyses/modes/modes_print.h"
#include "analyses/modes/modes_study.h"
#include "analyses/parts/study_print.h"
#include "model/data/model.h"
#include "output/plot.h"
#include "output/print.h"
#include "output/result_table.h"
#include "output/samples.h"
#include <kempe/modes.h>
#include <math.h>
#include <string.h>

enum { MOST_MOVERS = 4, MOST_RANGES = 6, MOST_NAMES = 12, INDENT = 4 };

/* The least participation that is printed, and the least share of a coordinate that is printed for a zero. */
#define LEAST_SHARE 0.02
/* Shares that differ by no more than this part of the larger one are equal but for rounding. */
#define EQUAL_SHARES 1e-6
#define LEAST_PART   1e-9

static const char *name_of(const kempe_modes *m, int coordinate)
{
    return m->system->model->motions[coordinate].name;
}

/* -- words ------------------------------------------------------------------------------------------- */

/* The largest |share| below `limit`; 0: there is none. */
static double largest_below(int n, const double *share, double limit)
{
    double most = 0;
    for (int k = 0; k < n; k++)
        most = fabs(share[k]) < limit && fabs(share[k]) > most ? fabs(share[k]) : most;
    return most;
}

int kmp_modes_order_shares(int n, const double *share, int most, int *order)
{
    int count = 0;
    double above = INFINITY, high, low, next;
    while (count < most && (high = largest_below(n, share, above)) >= LEAST_SHARE * (1 - EQUAL_SHARES)) {
        for (low = high; (next = largest_below(n, share, low)) >= low * (1 - EQUAL_SHARES) && next > 0;)
            low = next;
        for (int k = 0; k < n && count < most; k++)
            if (fabs(share[k]) >= low && fabs(share[k]) <= high)
                order[count++] = k;
        above = low;
    }
    return count;
}

/* Shares add up to 1; coordinates that move against each other with a common inertia have one below zero. */
static void put_movers(kmp_text *text, const kempe_modes *m, int c, int most)
{
    const double *share = m->modes.kinetic + (ptrdiff_t)c * m->modes.n;
    int order[MOST_MOVERS];
    const int count = kmp_modes_order_shares(m->modes.n, share, most, order);
    for (int k = 0; k < count; k++)
        kmp_text_printf(text, "%s%s %.0f %%", k ? ", " : "", name_of(m, order[k]), 100 * share[order[k]]);
}

/* " (0.3 rad)": a coordinate in a shape, with its unit, where the model has coordinates of both kinds. */
static void put_part(kmp_text *text, const kempe_modes *m, int c, int k)
{
    kmp_text_put(text, " (");
    kmp_print_quantity(text, m->system->context, 3, m->modes.shown_re[k + (ptrdiff_t)c * m->modes.n],
                       kmp_quantity_unit(m->system, KMP_QUANTITY_Q, k));
    kmp_text_put(text, ")");
}

/* The direction of a zero: "along X", or with other coordinates. */
static void put_along(kmp_text *text, const kempe_modes *m, int c)
{
    const double *re = m->modes.shown_re + (ptrdiff_t)c * m->modes.n, *scale = m->system->scale;
    int first = -1, others = 0;
    for (int k = 0; k < m->modes.n; k++)
        if (fabs(re[k]) / scale[k] >= 1 - 1e-6 && first < 0)
            first = k;
    kmp_text_printf(text, "along %s", first >= 0 ? name_of(m, first) : "nothing");
    for (int k = 0; k < m->modes.n; k++)
        if (k != first && fabs(re[k]) > LEAST_PART * scale[k]) {
            if (others == 0 && first >= 0)
                put_part(text, m, c, first);
            if (others < MOST_MOVERS)
                kmp_text_printf(text, "%s%s", others ? ", " : " with ", name_of(m, k));
            if (others < MOST_MOVERS)
                put_part(text, m, c, k);
            others++;
        }
    if (others > MOST_MOVERS)
        kmp_text_printf(text, " and %d more", others - MOST_MOVERS);
}

static int worst_of(const kempe_modes *m)
{
    int worst = 0;
    for (int c = 1; c < m->modes.count; c++)
        if (m->modes.spectrum.im[c] >= 0 && m->modes.spectrum.re[c] > m->modes.spectrum.re[worst])
            worst = c;
    return worst;
}

/* The keyword of the summary. */
static const char *verdict_of(const kempe_modes *m)
{
    if (m->modes.count == 0)
        return "none";
    int worst = worst_of(m);
    double noise = kmp_modes_noise(&m->modes), re = m->modes.spectrum.re[worst];
    if (re > noise || m->modes.spectrum.secular)
        return "unstable";
    if (m->modes.endless && isnan(m->modes.bound))
        return "undecided";
    return m->modes.spectrum.zeros > 0 ? "neutral" : re >= -noise ? "undamped" : "stable";
}

/* The summary, a sentence without its full stop. */
static void put_verdict(kmp_text *text, const kempe_modes *m)
{
    const char *word = verdict_of(m);
    const kmp_spectrum *s = &m->modes.spectrum;
    if (strcmp(word, "none") == 0) {
        kmp_text_put(text, "no modes: closures, drives or friction that sticks leave no degree of freedom");
        return;
    }
    int worst = worst_of(m);
    if (strcmp(word, "unstable") == 0 && s->secular && s->re[worst] <= KMP_SPECTRUM_EQUAL * kmp_modes_size(&m->modes)) {
        if (s->secular_at >= s->zeros)
            kmp_text_printf(
                text,
                "unstable: at %.4g Hz eigenvalues coincide and have one shape, so that the oscillation grows "
                "in proportion to time: ",
                kmp_mode_frequency(0, s->im[s->secular_at]));
        else
            kmp_text_put(text, "unstable: a displacement grows as a power of time: ");
        put_movers(text, m, s->secular_at, MOST_MOVERS);
    } else if (strcmp(word, "unstable") == 0) {
        kmp_text_printf(text, "unstable: grows by e in %.4g s", 1 / s->re[worst]);
        if (s->im[worst] > 0)
            kmp_text_printf(text, " at %.4g Hz", kmp_mode_frequency(s->re[worst], s->im[worst]));
        kmp_text_put(text, ": ");
        put_movers(text, m, worst, MOST_MOVERS);
    } else if (strcmp(word, "neutral") == 0) {
        kmp_text_put(text, "neutral: free motion ");
        for (int c = 0; c < s->still; c++) {
            kmp_text_put(text, c ? "; " : "");
            put_along(text, m, c);
        }
        kmp_text_put(text, "; no mode grows");
    } else if (strcmp(word, "undecided") == 0) {
        kmp_text_put(text, "undecided: no eigenvalue that was found grows, but with delays some may be missing");
    } else if (strcmp(word, "undamped") == 0) {
        kmp_text_put(text, "undamped: no mode grows, but not all decay");
    } else {
        kmp_text_put(text, "stable: every mode decays");
    }
}

/* -- text -------------------------------------------------------------------------------------------- */

/* The part of a flexible body in the elastic energy of mode c. */
static double strain_of(const kempe_modes *m, const kmp_flexible *f, int c)
{
    double sum = 0;
    for (int k = f->first; k < f->first + f->count; k++)
        sum += m->modes.potential[k + (ptrdiff_t)c * m->modes.n];
    return sum;
}

/* "; elastic energy: rod 98 %" */
static void put_strain(kmp_text *text, const kempe_modes *m, int c)
{
    const double visible = 0.005;
    const kempe_model *model = m->system->model;
    const char *before = "; elastic energy: ";
    for (int k = 0; k < model->flexible_count; k++) {
        const double part = strain_of(m, &model->flexibles[k], c);
        if (fabs(part) < visible)
            continue;
        kmp_text_printf(text, "%s%s %.0f %%", before, model->bodies[model->flexibles[k].body].name, 100 * part);
        before = ", ";
    }
}

/* True if a listed share is below 0 or above 1. */
static bool is_coupled(const kempe_modes *m, int c)
{
    for (int k = 0; k < m->modes.n; k++) {
        const double share = m->modes.kinetic[k + (ptrdiff_t)c * m->modes.n];
        if (share < -LEAST_SHARE || share > 1 + LEAST_SHARE)
            return true;
    }
    return false;
}

static void put_pair(kmp_text *text, double re, double im)
{
    kmp_text pair = {0};
    kmp_text_printf(&pair, im > 0 ? "%.6g +- %.6g i" : "%.6g", re, im);
    kmp_text_printf(text, "  %27s", pair.s ? pair.s : "");
    kmp_text_free_part(text, &pair);
}

/* The motion of a mode: up to `most` coordinates, and the elastic energy of bodies. */
static void put_moves(kmp_text *text, const kempe_modes *m, int c, int most, bool strain)
{
    const double time = kmp_mode_time(m->modes.spectrum.re[c]);
    kmp_text movers = {0};
    put_movers(&movers, m, c, most);
    if (kmp_modes_is_over(&m->modes, c))
        kmp_text_put(text, "over within a sample");
    else if (time < 0)
        kmp_text_printf(text, "GROWS by e in %.3g s", -time);
    if (movers.length > 0)
        kmp_text_printf(text, "%s%s", time < 0 || kmp_modes_is_over(&m->modes, c) ? ": " : "", movers.s);
    kmp_text_free_part(text, &movers);
    if (strain)
        put_strain(text, m, c);
}

/* A line of the table: number, frequency and damping of an oscillation, time of decay, and as many coordinates as have
 * room; in full with the eigenvalue and all. */
static void show_mode(kmp_text *text, const kempe_modes *m, int number, int c, bool all)
{
    const double re = m->modes.spectrum.re[c], im = m->modes.spectrum.im[c], time = kmp_mode_time(re);
    const bool over = kmp_modes_is_over(&m->modes, c);
    kmp_text first = {0}, moves = {0};
    kmp_text_printf(&first, "  %4d", number);
    kmp_print_cells(&first, "  %13.6g  %13.6g  %14.6g", im > 0 ? kmp_mode_frequency(re, im) : NAN,
                    im > 0 ? kmp_mode_damping(re, im) : NAN, over || !(time > 0) ? NAN : time);
    if (all && m->modes.z_re)
        put_pair(&first, m->modes.z_re[c], m->modes.z_im[c]);
    else if (all)
        put_pair(&first, re, im);
    kmp_text_put(&first, "  ");
    put_moves(&moves, m, c, MOST_MOVERS, true);
    for (int most = MOST_MOVERS; !all && most > 0 && first.length + moves.length > KMP_PRINT_LINE; most--) {
        kmp_text_free(&moves);
        put_moves(&moves, m, c, most, false);
    }
    kmp_print_wrapped(text, first.s ? first.s : "", 2 * INDENT, moves.s ? moves.s : "");
    kmp_text_free_part(text, &first);
    kmp_text_free_part(text, &moves);
}

/* Remarks on the table. */
static void show_remarks(kmp_text *text, const kempe_modes *m, bool coupled)
{
    kmp_text line = {0};
    if (coupled)
        kmp_text_put(text, "  Shares above 100 % or below 0: these coordinates have inertia in common\n");
    if (m->modes.z_re) {
        kmp_shown as = kmp_shown_as(m->system->context, "s");
        kmp_text_printf(text, "  Samples repeat every %.6g %s: frequencies are known up to %.6g Hz\n",
                        as.factor * m->modes.period, as.unit, 0.5 / m->modes.period);
    }
    if (m->modes.endless) {
        kmp_text_printf(&line, "With delays there are infinitely many eigenvalues; %d are found", m->modes.shown);
        if (isfinite(m->modes.bound))
            kmp_text_printf(&line, ", all whose real part is above %.6g 1/s", m->modes.bound);
        kmp_print_wrapped(text, "  ", INDENT, line.s ? line.s : "");
        kmp_text_free_part(text, &line);
    }
}

static void show_modes(kmp_text *text, const kempe_modes *m, bool all)
{
    const kmp_spectrum *s = &m->modes.spectrum;
    int number = s->still;
    bool coupled = false;
    if (s->count > s->zeros)
        kmp_text_printf(text, "\n  %4s  %13s  %13s  %14s", "mode", "frequency, Hz", "damping ratio", "decay by e, s");
    if (s->count > s->zeros && all)
        kmp_text_printf(text, "  %27s  moves mainly\n", m->modes.z_re ? "z of a sample" : "eigenvalue, 1/s");
    else if (s->count > s->zeros)
        kmp_text_put(text, "  moves mainly (share of kinetic energy)\n");
    for (int c = s->zeros; c < s->count; c++)
        if (s->im[c] >= 0) {
            show_mode(text, m, ++number, c, all);
            coupled = coupled || is_coupled(m, c);
        }
    show_remarks(text, m, coupled);
}

kmp_shown kmp_modes_shown(const kempe_modes *modes)
{
    return kmp_shown_of(modes->system, modes->name);
}

/* The next steps of the sweep in a row, behind value *k, whose modes were not assigned with certainty: from value
 * *first to value *k. False: there are none. */
static bool next_uncertain(const kmp_locus *l, int *first, int *k)
{
    int at = *k + 1;
    while (at < l->reached && l->doubt[at] <= 1)
        at++;
    *first = at - 1;
    while (at < l->reached && l->doubt[at] > 1)
        at++;
    *k = at - 1;
    return *first < *k;
}

/* The values at which the stability changes, and where modes could not be followed. */
static void show_locus(kmp_text *text, const kempe_modes *m)
{
    const kmp_locus *l = &m->locus;
    const double factor = kmp_modes_shown(m).factor;
    kmp_text line = {0};
    for (int k = 0; k < l->critical_count; k++) {
        const kmp_critical *c = &l->critical[k];
        kmp_text_printf(text, "  %s = ", m->name);
        kmp_print_value_of(text, m->system, m->name, c->value);
        if (c->im > 1e-6 * hypot(c->re, c->im) && c->im > 0)
            kmp_text_printf(text, ": a mode of %.6g Hz (%.6g rad/s)", c->im / (2 * acos(-1)), c->im);
        else
            kmp_text_put(text, ": a mode without oscillation");
        kmp_text_printf(text, " grows %s it\n", c->grows_above ? "above" : "below");
    }
    int reported = 0;
    for (int first, k = 0; next_uncertain(l, &first, &k); reported++)
        if (reported < MOST_RANGES)
            kmp_text_printf(&line, "%s%.6g to %.6g",
                            reported ? ", " : "Modes could not be followed with certainty over ",
                            factor * l->value[first], factor * l->value[k]);
    if (reported > MOST_RANGES)
        kmp_text_printf(&line, " and %d more ranges", reported - MOST_RANGES);
    if (reported > 0) {
        kmp_print_unit_of(&line, " ", m->system, m->name);
        kmp_text_printf(&line, " of %s: two modes are too close, or more values are needed", m->name);
        kmp_print_wrapped(text, "  ", INDENT, line.s ? line.s : "");
    }
    kmp_text_free_part(text, &line);
}

/* The independent coordinates, or the states among them: at most `most`. */
static void list_coordinates(kmp_text *text, const kempe_modes *m, bool states, int most)
{
    int listed = 0;
    for (int k = 0; k < m->modes.moving; k++) {
        int i = m->modes.u[k];
        if ((kmp_state_of(m->system->model, i) != NULL) != states)
            continue;
        if (listed < most)
            kmp_text_printf(text, "%s%s", listed > 0 ? ", " : "", kmp_name_of_coordinate(m->system, i));
        listed++;
    }
    if (listed > most)
        kmp_text_printf(text, " and %d more", listed - most);
}

static bool is_swept(const kempe_modes *m)
{
    return m->name && m->locus.reached > 0;
}

/* "stable: every mode decays"; free motions are listed below. */
static void put_answer(kmp_text *text, const kempe_modes *m)
{
    const int still = m->modes.spectrum.still, listed = m->modes.count > 0 ? still : 0;
    int modes = listed;
    for (int c = m->modes.spectrum.zeros; c < m->modes.count; c++)
        modes += m->modes.spectrum.im[c] >= 0;
    if (m->modes.count > 0)
        kmp_text_printf(text, "%d mode%s at %s%s, ", modes, modes == 1 ? "" : "s",
                        m->family->state->equilibrium ? "the equilibrium" : "the assembled start",
                        kmp_model_has_time(m->system->model) ? " (t = 0)" : "");
    if (strcmp(verdict_of(m), "neutral") == 0)
        kmp_text_printf(text, "neutral: %d free motion%s, no mode grows", still, still == 1 ? "" : "s");
    else
        put_verdict(text, m);
}

static void show_title(kmp_text *text, const kempe_modes *m)
{
    const kmp_locus *l = &m->locus;
    kmp_text title = {0};
    kmp_print_title(&title, m->system->model, kmp_outcome_of(m->status));
    if (is_swept(m)) {
        kmp_text_printf(&title, "%s from %.6g to ", m->name, kmp_modes_shown(m).factor * l->value[0]);
        kmp_print_value_of(&title, m->system, m->name, l->value[l->reached - 1]);
        kmp_text_printf(&title, ", %d values: ", l->reached);
        if (l->critical_count == 0)
            kmp_text_put(&title, "no mode changes its stability");
        else
            kmp_text_printf(&title, "%d change%s of stability", l->critical_count, l->critical_count == 1 ? "" : "s");
    } else {
        put_answer(&title, m);
    }
    kmp_print_answer(text, &title, kmp_outcome_of(m->status), m->warnings, "  Stopped: ", m->reason);
}

/* Constant rates, and motions without stiffness, whose eigenvalues are 0. */
static void show_steady(kmp_text *text, const kempe_modes *m)
{
    const kmp_spectrum *s = &m->modes.spectrum;
    const int still = m->modes.count > 0 ? s->still : 0;
    const bool steady = m->family->rate_count > 0;
    kmp_text line = {0};
    if (steady)
        kmp_steady_list(&line, m->system->model, m->family->rate_count, m->family->rates, m->qd);
    if (steady && still > 0)
        kmp_text_put(&line, "; free motion ");
    for (int c = 0; c < still; c++) {
        kmp_text_put(&line, c ? "; " : "");
        put_along(&line, m, c);
    }
    if (still > 0 && s->zeros > still)
        kmp_text_printf(&line, "; at a constant rate: %d of %d", s->zeros - still, still);
    if (line.length > 0)
        kmp_print_wrapped(text, steady ? "  Constant rates: " : "  Free motion ", INDENT, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
}

/* The coordinates, rates and states that modes are about. */
static void show_state(kmp_text *text, const kempe_modes *m, bool all)
{
    const int most = all ? m->modes.moving : MOST_NAMES;
    int freedoms = 0, states = 0;
    kmp_text line = {0};
    for (int k = 0; k < m->modes.moving; k++)
        *(kmp_state_of(m->system->model, m->modes.u[k]) ? &states : &freedoms) += 1;
    kmp_text_printf(&line, "%d degree%s of freedom%s", freedoms, freedoms == 1 ? "" : "s",
                    m->modes.moving > 0 ? ": " : "");
    list_coordinates(&line, m, false, most);
    if (states > 0) {
        kmp_text_put(&line, "; states: ");
        list_coordinates(&line, m, true, most);
    }
    kmp_print_wrapped(text, "  ", INDENT, line.s ? line.s : "");
    kmp_text_free_part(text, &line);
    show_steady(text, m);
    kmp_print_flexible(text, m->system->model, "  Flexible ");
    kmp_averaged_put(text, "  Tracks: ", m->averaged);
    kmp_print_held(text, "  Held: ", m->system, m->qd);
    if (!m->family->state->equilibrium)
        kmp_text_put(text, "  The start need not be an equilibrium: modes describe how small perturbations begin\n");
}

static void show_parts(kmp_text *text, const kempe_modes *m, bool all)
{
    show_title(text, m);
    if (is_swept(m)) {
        kmp_text answer = {0};
        show_locus(text, m);
        kmp_text_printf(&answer, "With %s of the model: ", m->name);
        put_answer(&answer, m);
        kmp_text_put(text, "\n");
        kmp_print_wrapped(text, "", INDENT, answer.s ? answer.s : "");
        kmp_text_free_part(text, &answer);
    }
    show_state(text, m, all);
    if (m->modes.count > 0)
        show_modes(text, m, all);
    if (m->modes.count > 0 && !all)
        kmp_text_printf(text, "  Eigenvalues: --all; shapes: --json, --report FILE%s\n",
                        is_swept(m) ? "; values of the sweep: -o FILE.csv, --svg FILE" : "");
}

/* -- JSON -------------------------------------------------------------------------------------------- */

static void json_pair(kmp_json *j, const char *key, double re, double im)
{
    const double pair[2] = {re, im};
    kmp_json_numbers(j, key, 2, pair);
}

static void json_mode(kmp_json *j, const kempe_modes *m, int c)
{
    const kmp_spectrum *s = &m->modes.spectrum;
    const double *re = m->modes.shown_re + (ptrdiff_t)c * m->modes.n,
                 *im = m->modes.shown_im + (ptrdiff_t)c * m->modes.n;
    kmp_text along = {0};
    kmp_json_put(j, "{ index %d", c);
    json_pair(j, "eigenvalue", s->re[c], s->im[c]);
    if (m->modes.z_re)
        json_pair(j, "z", m->modes.z_re[c], m->modes.z_im[c]);
    kmp_json_put(j, "frequency %g damping %g decay %g", s->im[c] > 0 ? kmp_mode_frequency(s->re[c], s->im[c]) : NAN,
                 s->im[c] > 0 ? kmp_mode_damping(s->re[c], s->im[c]) : NAN, kmp_mode_time(s->re[c]));
    if (c < s->zeros)
        put_along(&along, m, c);
    else
        put_movers(&along, m, c, MOST_MOVERS);
    kmp_json_text(j, "moves", &along);
    kmp_json_object(j, "shape");
    for (int k = 0; k < m->modes.n; k++)
        json_pair(j, name_of(m, k), re[k], im[k]);
    kmp_json_end(j);
    kmp_print_entries(j, "kinetic", m->system, KMP_QUANTITY_Q, m->modes.kinetic + (ptrdiff_t)c * m->modes.n);
    kmp_print_entries(j, "potential", m->system, KMP_QUANTITY_Q, m->modes.potential + (ptrdiff_t)c * m->modes.n);
    const kempe_model *model = m->system->model;
    if (model->flexible_count > 0) {
        kmp_json_object(j, "strain");
        for (int k = 0; k < model->flexible_count; k++)
            kmp_json_number(j, model->bodies[model->flexibles[k].body].name, strain_of(m, &model->flexibles[k], c));
        kmp_json_end(j);
    }
    kmp_json_end(j);
}

static void json_locus(kmp_json *j, const kempe_modes *m)
{
    const kmp_locus *l = &m->locus;
    kmp_json_put(j, "locus { name %s", m->name);
    kmp_json_numbers(j, "values", l->reached, l->value);
    kmp_json_array(j, "eigenvalues");
    for (int k = 0; k < l->reached; k++)
        kmp_print_pairs(j, NULL, l->count, l->re + (ptrdiff_t)k * l->count, l->im + (ptrdiff_t)k * l->count);
    kmp_json_put(j, "] loads {");
    for (int i = 0; i < m->modes.n; i++)
        if (kmp_locus_has_load(l, m->modes.n, i)) {
            kmp_json_array(j, name_of(m, i));
            for (int k = 0; k < l->reached; k++)
                kmp_json_number(j, NULL, l->load[i + (ptrdiff_t)k * m->modes.n]);
            kmp_json_end(j);
        }
    kmp_json_put(j, "} uncertain [");
    for (int first, k = 0; next_uncertain(l, &first, &k);)
        json_pair(j, NULL, l->value[first], l->value[k]);
    kmp_json_put(j, "] critical [");
    for (int k = 0; k < l->critical_count; k++) {
        const kmp_critical *c = &l->critical[k];
        kmp_json_put(j, "{ value %g", c->value);
        json_pair(j, "eigenvalue", c->re, c->im);
        kmp_json_put(j, "frequency %g branch %d grows %s }", kmp_mode_frequency(c->re, c->im), c->branch,
                     c->grows_above ? "above" : "below");
    }
    kmp_json_put(j, "] }");
}

void kmp_modes_json(kmp_json *j, const kempe_modes *m)
{
    const kmp_spectrum *s = &m->modes.spectrum;
    kmp_text verdict = {0};
    kmp_json_put(j, "at %s cyclic {", m->family->state->equilibrium ? "equilibrium" : "start");
    for (int i = 0; i < m->family->rate_count; i++)
        kmp_json_number(j, name_of(m, m->family->rates[i].coordinate), m->qd[m->family->rates[i].coordinate]);
    kmp_json_put(j, "} loads {");
    for (int i = 0; i < m->family->rate_count; i++)
        if (m->family->rates[i].how == KMP_RATE_HELD)
            kmp_json_number(j, name_of(m, m->family->rates[i].coordinate), m->family->rates[i].load);
    kmp_json_end(j);
    kmp_print_entries(j, "q", m->system, KMP_QUANTITY_Q, m->q);
    kmp_print_entries(j, "qd", m->system, KMP_QUANTITY_QD, m->qd);
    kmp_print_names(j, "u", m->system, kmp_name_of_coordinate, m->modes.moving, m->modes.u);
    kmp_print_pairs(j, "eigenvalues", s->count, s->re, s->im);
    /* All z in the order of the eigenvalues, which are ln(z)/T. */
    if (m->modes.z_re) {
        kmp_json_number(j, "sample_time", m->modes.period);
        kmp_print_pairs(j, "z", s->count, m->modes.z_re, m->modes.z_im);
    }
    kmp_print_held_json(j, m->system, m->qd);
    if (m->modes.endless)
        kmp_json_put(j, "endless { shown %d bound %g }", m->modes.shown, m->modes.bound);
    kmp_json_put(j, "zeros %d stability %s", s->zeros, verdict_of(m));
    put_verdict(&verdict, m);
    kmp_json_text(j, "reasons", &verdict);
    kmp_json_array(j, "modes");
    for (int c = 0; c < s->count; c++)
        if (kmp_modes_is_listed(m, c))
            json_mode(j, m, c);
    kmp_json_end(j);
    if (m->name)
        json_locus(j, m);
}

static void json_all(kmp_text *text, const void *result)
{
    const kempe_modes *m = result;
    kmp_json json =
        kmp_print_head(text, m->system, kmp_outcome_of(m->status), m->reason, m->system->build_s, m->warnings);
    kmp_modes_json(&json, m);
    kmp_json_put(&json, "cpu_s %g }", m->cpu_s);
}

KMP_PRINT_FULL(kempe_modes, modes, modes->system->context, json_all, show_parts)

static void fill_modes(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    const kmp_spectrum *s = &m->modes.spectrum;
    kmp_tabulate_columns(table, "index re[1/s] im[1/s] frequency[Hz] damping decay[s]");
    if (m->modes.z_re)
        kmp_tabulate_columns(table, "z.re z.im");
    kmp_tabulate_apart(table);
    for (int k = 0; k < 2 * m->modes.n; k++)
        kmp_tabulate_column(table, kmp_quantity_unit(m->system, KMP_QUANTITY_Q, k / 2), "%s.%s", k % 2 ? "im" : "re",
                            m->system->model->motions[k / 2].name);
    for (int c = 0; c < s->count; c++) {
        double re = s->re[c], im = s->im[c];
        ptrdiff_t at = (ptrdiff_t)c * m->modes.n;
        KMP_TABULATE(table, "%d %g %g %g %g %g", c, re, im, kmp_mode_frequency(re, im), kmp_mode_damping(re, im),
                     kmp_mode_time(re));
        if (m->modes.z_re)
            kmp_tabulate_cells(table, "%g %g", m->modes.z_re[c], m->modes.z_im[c]);
        for (int k = 0; k < m->modes.n; k++)
            kmp_tabulate_cells(table, "%g %g", m->modes.shown_re[k + at], m->modes.shown_im[k + at]);
    }
}

static void fill_sweep(kempe_table *table, const kempe_modes *m)
{
    const kmp_locus *l = &m->locus;
    const kmp_motion *motions = m->system->model->motions;
    const int n = m->modes.n;
    kmp_tabulate_value(table, m->system, "", m->name);
    for (int k = 0; k < 2 * l->count; k++)
        kmp_tabulate_column(table, "1/s", "%s.%d", k % 2 ? "im" : "re", k / 2 + 1);
    for (int i = 0; i < n; i++)
        if (kmp_locus_has_load(l, n, i))
            kmp_tabulate_column(table, motions[i].rotation ? "N m" : "N", "load.%s", motions[i].name);
    for (int k = 0; k < l->reached; k++) {
        ptrdiff_t at = (ptrdiff_t)k * l->count;
        KMP_TABULATE(table, "%g", l->value[k]);
        for (int b = 0; b < l->count; b++)
            kmp_tabulate_cells(table, "%g %g", l->re[b + at], l->im[b + at]);
        for (int i = 0; i < n; i++)
            if (kmp_locus_has_load(l, n, i))
                kmp_tabulate_number(table, l->load[i + (ptrdiff_t)k * n]);
    }
}

static void fill_rows(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    if (m->name)
        fill_sweep(table, m);
    else
        fill_modes(table, m);
}

static void fill_critical(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    const char *unit = m->name ? kmp_quantity_unit_of(m->system, m->name) : "";
    kmp_tabulate_column(table, kmp_print_unknown(m->system->context, unit), "value");
    kmp_tabulate_columns(table, "re[1/s] im[1/s] frequency[Hz] branch grows[words]");
    for (int k = 0; k < m->locus.critical_count; k++) {
        const kmp_critical *c = &m->locus.critical[k];
        KMP_TABULATE(table, "%g %g %g %g %d %s", c->value, c->re, c->im, kmp_mode_frequency(c->re, c->im),
                     c->branch + 1, c->grows_above ? "above" : "below");
    }
}

static void fill_state(kempe_table *table, const void *result)
{
    const kempe_modes *m = result;
    kmp_tabulate_quantity(table, m->system, KMP_QUANTITY_Q);
    kmp_tabulate_quantity(table, m->system, KMP_QUANTITY_QD);
    kmp_tabulate_row(table);
    kmp_tabulate_values(table, m->system, KMP_QUANTITY_Q, m->q);
    kmp_tabulate_values(table, m->system, KMP_QUANTITY_QD, m->qd);
}

KMP_TABLES(kempe_modes, modes, modes->system->context, {"rows", fill_rows}, {"modes", fill_modes},
           {"critical", fill_critical}, {"state", fill_state})

/* -- picture: eigenvalues in the plane on the left, frequencies over the value on the right ----------------- */

enum { WIDTH = 524, HEIGHT = 400 };

/* Extent of the plane to the left, relative to its height. */
#define FAR 3

/* The drawn point of an eigenvalue: in the plane, or a frequency over the value; NaN: none, as beyond the highest. */
typedef struct drawn {
    double x, y;
} drawn;

/* Value k of what varies, as the axis has it. */
static double swept(const kempe_modes *m, int k)
{
    return kmp_modes_shown(m).factor * m->locus.value[k];
}

typedef drawn point_fn(const kempe_modes *m, int k, int branch);

static drawn in_plane(const kempe_modes *m, int k, int branch)
{
    ptrdiff_t at = branch + (ptrdiff_t)k * m->locus.count;
    const double re = m->locus.re[at], im = fabs(m->locus.im[at]);
    return hypot(re, im) <= m->highest ? (drawn){re, im} : (drawn){NAN, NAN};
}

static drawn over_value(const kempe_modes *m, int k, int branch)
{
    double size = in_plane(m, k, branch).y;
    return (drawn){swept(m, k), size > 0 ? size / (2 * acos(-1)) : NAN};
}

static void reach_branches(kmp_plot *p, const kempe_modes *m, point_fn *point)
{
    for (int k = 0; k < m->locus.reached; k++)
        for (int b = 0; b < m->locus.count; b++)
            kmp_plot_reach(p, point(m, k, b).x, point(m, k, b).y);
}

static void put_branches(kmp_plot *p, const kempe_modes *m, point_fn *point)
{
    for (int b = 0; b < m->locus.count; b++) {
        bool any = false;
        for (int k = 0; k < m->locus.reached; k++)
            any = any || isfinite(point(m, k, b).y);
        if (!any)
            continue;
        const char *colour = kmp_plot_colour(b / 2);
        drawn first = point(m, 0, b);
        kmp_curve_begin(p, "curve", colour);
        for (int k = 0; k < m->locus.reached; k++)
            kmp_curve_to(p, point(m, k, b).x, point(m, k, b).y);
        kmp_curve_end(p);
        if (isfinite(first.y))
            kmp_plot_dot(p, first.x, first.y, colour);
    }
}

static void put_line(kmp_plot *p, const char *class, double x0, double y0, double x1, double y1)
{
    kmp_curve_begin(p, class, NULL);
    kmp_curve_to(p, x0, y0);
    kmp_curve_to(p, x1, y1);
    kmp_curve_end(p);
}

static void put_campbell(kmp_text *text, const kempe_modes *m)
{
    kmp_plot p = kmp_plot_inside(text, WIDTH, 0, WIDTH, HEIGHT);
    kmp_axis *value = &p.axis[0], *frequency = &p.axis[1];
    for (int k = 0; k < m->locus.reached; k++)
        kmp_plot_reach(&p, swept(m, k), 0);
    reach_branches(&p, m, over_value);
    value->name = m->name;
    value->unit = kmp_modes_shown(m).unit;
    frequency->name = "frequency, Hz";
    kmp_plot_begin(&p, m->order_count ? "Frequencies, and orders of what varies" : "Frequencies");
    /* Frequency = order * value / (2 pi), with the order at its end in the frame. */
    for (int k = 0; k < m->order_count; k++) {
        double slope = m->order[k] / (2 * acos(-1) * kmp_modes_shown(m).factor),
               end = fmin(value->high, p.axis[1].high / slope);
        put_line(&p, "order", value->low, slope * value->low, value->high, slope * value->high);
        if (end > value->low)
            kmp_picture_words(p.text, kmp_plot_x(&p, end) - 5, kmp_plot_y(&p, slope * end) + 13,
                              "class=\"order-name\" text-anchor=\"end\"", "%.4g", m->order[k]);
    }
    put_branches(&p, m, over_value);
    for (int k = 0; k < m->locus.critical_count; k++) {
        const kmp_critical *c = &m->locus.critical[k];
        double at = kmp_modes_shown(m).factor * c->value;
        put_line(&p, "critical", at, frequency->low, at, frequency->high);
        kmp_plot_cross(&p, at, kmp_mode_frequency(c->re, c->im));
    }
    kmp_plot_end(&p);
}

static void draw(kmp_text *text, const kempe_modes *m)
{
    kmp_picture_begin(text, 2 * WIDTH, HEIGHT,
                      ".axis{stroke:#4a545a;fill:none}.critical{stroke:#111;stroke-dasharray:2 3;fill:none}"
                      ".order{stroke:#8a949a;stroke-dasharray:7 4;fill:none}.order-name{fill:#6a747a}");
    /* Distant real eigenvalues are cut off, with a note, so that the others remain visible. */
    const kmp_locus *l = &m->locus;
    kmp_plot p = kmp_plot_inside(text, 0, 0, WIDTH, HEIGHT);
    kmp_axis *re = &p.axis[0], *im = &p.axis[1];
    double left = 0;
    kmp_plot_reach(&p, 0, 0);
    reach_branches(&p, m, in_plane);
    for (int k = 0; k < l->reached; k++)
        for (int b = 0; b < l->count; b++)
            left = in_plane(m, k, b).y > 0 ? fmin(left, in_plane(m, k, b).x) : left;
    double least = re->low, bound = fmin(left, -FAR * im->high);
    bool cut = im->high > 0 && least < bound;
    if (cut)
        re->low = bound;
    re->name = "real part, 1/s";
    im->name = "imaginary part, rad/s";
    kmp_shown as = kmp_modes_shown(m);
    kmp_plot_begin(&p, "Eigenvalues, %s from %.6g (dots) to %.6g%s%s", m->name, swept(m, 0), swept(m, l->reached - 1),
                   as.unit[0] ? " " : "", as.unit);
    if (re->low < 0 && re->high > 0)
        put_line(&p, "axis", 0, im->low, 0, im->high);
    put_branches(&p, m, in_plane);
    if (cut)
        kmp_picture_words(text, 8, 18, "", "\xe2\x86\x90 real ones as far as %.4g", least);
    for (int k = 0; k < l->critical_count; k++)
        kmp_plot_cross(&p, l->critical[k].re, l->critical[k].im);
    kmp_plot_end(&p);
    put_campbell(text, m);
    kmp_picture_end(text);
}

kempe_status kempe_modes_write_picture(const kempe_modes *modes, const char *path)
{
    KMP_WANTED(NULL, modes, "modes");
    KMP_WANTED(modes->system->context, path, "path");
    kmp_text text = {0};
    kmp_context_clear(modes->system->context);
    if (!modes->name || modes->locus.reached == 0)
        return kmp_fail(modes->system->context, KEMPE_E_ARGUMENT, "a picture shows what varies, and nothing does");
    draw(&text, modes);
    return kmp_picture_write(modes->system->context, path, &text);
}
