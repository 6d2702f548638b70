/* SPDX-License-Identifier: BSD-3-Clause */
#include "ensemble/instance_table.h"
#include "base/context.h"
#include "base/text.h"
#include "constraints/tolerances.h"
#include "output/print.h"
#include "output/result_table.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

/* -- sums -------------------------------------------------------------------------------------------- */

static const char *word_of(const kempe_table *t, int row, int column)
{
    const char *word = column >= 0 ? kempe_table_word(t, row, column) : NULL;
    return word ? word : "";
}

static long add_up(const kempe_table *t, const char *name)
{
    const double *x = kempe_table_values(t, kempe_table_find(t, name));
    long sum = 0;
    for (int row = 0; x && row < kempe_table_row_count(t); row++)
        sum += isnan(x[row]) ? 0 : (long)x[row];
    return sum;
}

/* The largest known value of a column, 0 for none; *at: its row, -1 for none. */
static double largest_of(const kempe_table *t, int column, int *at)
{
    const double *x = kempe_table_values(t, column);
    double most = 0;
    *at = -1;
    for (int row = 0; x && row < kempe_table_row_count(t); row++)
        if (!isnan(x[row]) && (*at < 0 || x[row] > most)) {
            most = x[row];
            *at = row;
        }
    return most;
}

static double worst_of(const kempe_table *t, const char *name)
{
    int at;
    return fmax(largest_of(t, kempe_table_find(t, name), &at), 0);
}

void kmp_instances_count(kmp_instance_sums *s, const char *word)
{
    const kempe_outcome outcome = kmp_outcome_read(word);
    s->ok += kmp_outcome_is_complete(outcome);
    s->distrusted += outcome == KEMPE_OUTCOME_NOT_TRUSTWORTHY;
    s->stopped += outcome == KEMPE_OUTCOME_STOPPED;
    s->failed += outcome == KEMPE_OUTCOME_FAILED;
}

kmp_instance_sums kmp_instances_sum(const kempe_table *t, long first)
{
    kmp_instance_sums s = {.count = kempe_table_row_count(t),
                           .steps = add_up(t, "steps"),
                           .rejected = add_up(t, "rejected"),
                           .refused = add_up(t, "refused"),
                           .rhs = add_up(t, "rhs"),
                           .exchanges = add_up(t, "exchanges"),
                           .h = worst_of(t, "h"),
                           .hdot = worst_of(t, "hdot"),
                           .drift = worst_of(t, "drift")};
    int status = kempe_table_find(t, "status"), start = kempe_table_find(t, "start");
    for (int row = 0; row < kempe_table_row_count(t); row++) {
        kmp_instances_count(&s, word_of(t, row, status));
        if (strcmp(word_of(t, row, start), KMP_RATES_ADJUSTED) == 0 && s.rates_changed++ == 0)
            s.first_changed = first + row;
        if (strcmp(word_of(t, row, start), KMP_GAPS_CHANGED) == 0 && s.gaps_changed++ == 0)
            s.first_gap = first + row;
        if (strcmp(word_of(t, row, start), KMP_BALANCE_UNSTABLE) == 0 && s.unstable++ == 0)
            s.first_unstable = first + row;
        if (strcmp(word_of(t, row, start), KMP_EQUILIBRIUM_UNSTABLE) == 0 && s.leaving++ == 0)
            s.first_leaving = first + row;
    }
    /* The lists name instances that have not converged. */
    int verdict = kempe_table_find(t, "verdict"), difference = kempe_table_find(t, "difference");
    for (int row = 0; row < kempe_table_row_count(t); row++) {
        const char *word = word_of(t, row, verdict);
        double by = strcmp(word, "not converged") == 0 ? kempe_table_number(t, row, difference) : INFINITY;
        const bool deflected = strcmp(word, KMP_DEFLECTED_FAR) == 0;
        const bool shared = strcmp(word, KMP_LOADS_SHARED) == 0;
        s.repeated += deflected || shared ? isfinite(kempe_table_number(t, row, difference)) : *word != '\0';
        if (deflected && s.deflected++ == 0)
            s.first_deflected = first + row;
        if (shared && s.shared++ == 0)
            s.first_shared = first + row;
        if (deflected || shared)
            continue;
        if (!*word || strcmp(word, "converged") == 0)
            continue;
        if (s.not_converged++ == 0 || by > s.difference) {
            s.worst = first + row;
            s.difference = by;
        }
    }
    return s;
}

void kmp_instances_add(kmp_instance_sums *s, const kmp_instance_sums *part)
{
    if (part->rates_changed > 0 && (s->rates_changed == 0 || part->first_changed < s->first_changed))
        s->first_changed = part->first_changed;
    if (part->gaps_changed > 0 && (s->gaps_changed == 0 || part->first_gap < s->first_gap))
        s->first_gap = part->first_gap;
    if (part->unstable > 0 && (s->unstable == 0 || part->first_unstable < s->first_unstable))
        s->first_unstable = part->first_unstable;
    if (part->leaving > 0 && (s->leaving == 0 || part->first_leaving < s->first_leaving))
        s->first_leaving = part->first_leaving;
    if (part->deflected > 0 && (s->deflected == 0 || part->first_deflected < s->first_deflected))
        s->first_deflected = part->first_deflected;
    if (part->shared > 0 && (s->shared == 0 || part->first_shared < s->first_shared))
        s->first_shared = part->first_shared;
    if (part->not_converged > 0 && (s->not_converged == 0 || part->difference > s->difference)) {
        s->worst = part->worst;
        s->difference = part->difference;
    }
    s->count += part->count;
    s->ok += part->ok;
    s->distrusted += part->distrusted;
    s->stopped += part->stopped;
    s->failed += part->failed;
    s->steps += part->steps;
    s->rejected += part->rejected;
    s->refused += part->refused;
    s->rhs += part->rhs;
    s->exchanges += part->exchanges;
    s->h = fmax(s->h, part->h);
    s->hdot = fmax(s->hdot, part->hdot);
    s->drift = fmax(s->drift, part->drift);
    s->rates_changed += part->rates_changed;
    s->gaps_changed += part->gaps_changed;
    s->unstable += part->unstable;
    s->leaving += part->leaving;
    s->deflected += part->deflected;
    s->shared += part->shared;
    s->repeated += part->repeated;
    s->not_converged += part->not_converged;
}

/* -- words ------------------------------------------------------------------------------------------- */

static void put_remarks(kmp_text *text, const kmp_instance_sums *s)
{
    if (s->rates_changed > 0)
        kmp_text_printf(text,
                        "start: initial velocities were adjusted to satisfy the closures in %ld of %ld instances, "
                        "first in instance %ld\n",
                        s->rates_changed, s->count, s->first_changed + 1);
    if (s->gaps_changed > 0)
        kmp_text_printf(text,
                        "start: closing the loops changes the slack of ropes, or the play of teeth, in %ld of %ld "
                        "instances, first in instance %ld: give lengths, or closed starts\n",
                        s->gaps_changed, s->count, s->first_gap + 1);
    if (s->leaving > 0)
        kmp_text_printf(text,
                        "start: %ld of %ld instances begin at an unstable equilibrium, first instance %ld: their "
                        "motions leave it after a time that depends on rounding, unless something else disturbs them\n",
                        s->leaving, s->count, s->first_leaving + 1);
}

static void put_ended(kmp_text *text, const kmp_instance_sums *s)
{
    if (s->count > s->ok)
        kmp_text_printf(text, "%ld of %ld instances did not reach their end: their rows have the reasons\n",
                        s->count - s->ok, s->count);
}

/* Why instances that reached their end cannot be trusted; nothing where they can. */
static void put_doubts(kmp_text *text, const kmp_instance_sums *s)
{
    if (s->unstable > 0)
        kmp_text_printf(
            text,
            "do not trust %ld of %ld instances: the deformations of instance %ld start in a balance that is "
            "not stable, under loads at which a flexible body buckles\n",
            s->unstable, s->count, s->first_unstable + 1);
    if (s->deflected > 0)
        kmp_text_printf(
            text,
            "do not trust %ld of %ld instances: a flexible body of instance %ld deflects by more than %.1f of "
            "its length; divide it into 'segments'\n",
            s->deflected, s->count, s->first_deflected + 1, KMP_DEFLECTION_LARGE);
    if (s->shared > 0)
        kmp_text_printf(text,
                        "do not trust %ld of %ld instances, the first is instance %ld: redundant contacts share their "
                        "loads, and the motion depends on how\n",
                        s->shared, s->count, s->first_shared + 1);
    if (s->not_converged > 0 && isinf(s->difference))
        kmp_text_printf(text,
                        "do not trust %ld of %ld instances: at another rtol the run of instance %ld did not reach its "
                        "end; use a smaller rtol\n",
                        s->not_converged, s->count, s->worst + 1);
    else if (s->not_converged > 0)
        kmp_text_printf(text,
                        "do not trust %ld of %ld instances: at another rtol instance %ld differs by %.2g; use a "
                        "smaller rtol\n",
                        s->not_converged, s->count, s->worst + 1, s->difference);
}

void kmp_instances_put_distrusted(kmp_text *text, const kmp_instance_sums *s)
{
    kmp_text_printf(text,
                    "%ld instance%s not trustworthy: the columns verdict and start have the reasons, or a run of one "
                    "of them (kempe simulate --from FOLDER --instance K)\n",
                    s->distrusted, s->distrusted == 1 ? " is" : "s are");
}

void kmp_instances_put_warnings(kmp_text *text, const kmp_instance_sums *s)
{
    put_remarks(text, s);
    put_ended(text, s);
    put_doubts(text, s);
    if (s->distrusted > s->unstable + s->deflected + s->shared + s->not_converged)
        kmp_instances_put_distrusted(text, s);
}

kempe_status kmp_instances_warn(kempe_context *context, const kmp_instance_sums *s)
{
    kmp_text text = {0}, doubts = {0};
    put_remarks(&text, s);
    put_ended(&doubts, s);
    put_doubts(&doubts, s);
    for (const char *line = text.s; line && *line; line += strcspn(line, "\n") + 1)
        kmp_log(context, KEMPE_LOG_WARNING, "%.*s", (int)strcspn(line, "\n"), line);
    for (const char *line = doubts.s; line && *line; line += strcspn(line, "\n") + 1)
        kmp_doubt(context, "%.*s", (int)strcspn(line, "\n"), line);
    kempe_status status = kmp_made(context, !text.failed && !doubts.failed);
    kmp_text_free(&text);
    kmp_text_free(&doubts);
    return status;
}

kempe_outcome kmp_instances_outcome(const kmp_instance_sums *s)
{
    bool doubted = s->doubted || s->ok < s->count || s->not_converged > 0 || s->distrusted > 0;
    return s->count > 0 && s->ok == 0 ? (s->failed > 0 ? KEMPE_OUTCOME_FAILED : KEMPE_OUTCOME_STOPPED)
                                      : kmp_outcome_checked(doubted ? KEMPE_UNTRUSTED : KEMPE_OK, s->repeated > 0);
}

void kmp_instances_put_answer(kmp_text *text, const char *model, kempe_outcome outcome, const kmp_instance_sums *s,
                              const kmp_instance_causes *causes)
{
    kmp_text_printf(text, "%s: %s, ", model, kempe_outcome_text(outcome));
    if (s->ok < s->count) {
        kmp_text_printf(text, "%ld of %ld instances complete", s->ok, s->count);
        if (s->stopped > 0)
            kmp_text_printf(text, ", %ld stopped", s->stopped);
        if (s->failed > 0)
            kmp_text_printf(text, ", %ld failed", s->failed);
        kmp_text_put(text, "\n");
    } else {
        const bool passed = s->repeated > 0 && s->not_converged == 0 && s->repeated == s->count;
        kmp_text_printf(text, "%ld instance%s%s\n", s->count, s->count == 1 ? "" : "s",
                        passed ? ", all passed the accuracy check" : "");
    }
    kmp_instance_causes_put(text, causes);
}

void kmp_instances_put_accuracy(kmp_text *text, const char *label, const kmp_instance_sums *s)
{
    kmp_text_printf(text, "%-10senergy balance at most %.2g of the energy exchanged; loops closed to %.2g (relative)\n",
                    label, s->drift, s->h);
    if (s->not_converged > 0)
        kmp_text_printf(text, "          %ld of %ld instances passed the check by a second run\n",
                        s->repeated - s->not_converged, s->repeated);
}

void kmp_instances_put_measured(kmp_text *text, const kempe_table *instances, long first)
{
    /* The largest difference of each quantity at another tolerance. */
    static const char ending[] = ".difference";
    for (int c = kempe_table_find(instances, "drift"); c < kempe_table_column_count(instances); c++) {
        const char *name = kempe_table_column_name(instances, c), *unit = kempe_table_unit(instances, c);
        size_t length = strlen(name), end = strlen(ending);
        int at = -1;
        if (length < end || strcmp(name + length - end, ending) != 0)
            continue;
        double most = largest_of(instances, c, &at);
        if (at < 0)
            continue;
        const kempe_context *context = kmp_table_context(instances);
        kmp_text_printf(text, "          a second run changes '%.*s' by at most ", (int)(length - end), name);
        kmp_print_quantity(text, context, 2, most, kmp_print_unknown(context, unit));
        kmp_text_printf(text, ", of instance %ld\n", first + at + 1);
    }
}

void kmp_instances_put_statistics(kmp_text *text, const kempe_statistics *statistics)
{
    char *said = NULL;
    if (!statistics)
        return;
    text->failed = text->failed || kempe_statistics_print(statistics, KEMPE_TEXT, &said) != KEMPE_OK;
    kmp_text_printf(text, "\n%s", said ? said : "");
    kempe_text_free(said);
}

void kmp_instances_put(kmp_text *text, const char *model, const kempe_table *instances,
                       const kempe_statistics *statistics, bool doubted)
{
    kmp_instance_sums s = kmp_instances_sum(instances, 0);
    kmp_instance_causes causes = {0};
    s.doubted = doubted;
    kmp_instance_causes_add(&causes, instances, 0);
    kmp_instances_put_answer(text, model, kmp_instances_outcome(&s), &s, &causes);
    kmp_instance_causes_free(&causes);
    kmp_text doubts = {0};
    put_doubts(&doubts, &s);
    kmp_print_doubts(text, KEMPE_OUTCOME_NOT_TRUSTWORTHY, doubts.s);
    kmp_text_free_part(text, &doubts);
    kmp_text_put(text, "\n");
    kmp_instances_put_accuracy(text, "accuracy", &s);
    kmp_instances_put_measured(text, instances, 0);
    kmp_instances_put_statistics(text, statistics);
}
