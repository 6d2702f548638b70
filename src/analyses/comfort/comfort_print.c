/* SPDX-License-Identifier: BSD-3-Clause */
/* Ride comfort as a report and as one JSON object. */
#include "analyses/comfort/comfort_study.h"
#include "output/print.h"
#include <math.h>
#include <string.h>

static double worst(const kempe_comfort *c)
{
    double difference = 0;
    for (int k = 0; k < c->count; k++)
        difference = fmax(difference, c->signal[k].difference);
    return difference;
}

static void show(kmp_text *text, const void *result)
{
    const kempe_comfort *c = result;
    kmp_print_title(text, c->system->model, kmp_status_word(c->status));
    kmp_text_printf(text, "ride comfort from t = %.6g s to %.6g s, %d window%s of %g s\n\n", c->from,
                    c->from + c->windows * KMP_COMFORT_WINDOW, c->windows, c->windows == 1 ? "" : "s",
                    KMP_COMFORT_WINDOW);
    int width = 0;
    for (int k = 0; k < c->count; k++) {
        int length = (int)strlen(c->signal[k].name);
        width = length > width ? length : width;
    }
    kmp_text_printf(text, "%-14s%-*s  weighting    rms  weighted   median     95 %%  largest     Wz\n", "m/s^2", width,
                    "");
    for (int k = 0; k < c->count; k++) {
        const kmp_comfort_signal *s = &c->signal[k];
        const kmp_comfort_row *row = &kmp_comfort_rows[s->direction];
        kmp_text_printf(text, "%-12s  %-*s  %-9s", row->name, width, s->name, kmp_weighting_name(row->weighting));
        kmp_text_printf(text, "  %.4f    %.4f   %.4f   %.4f   %.4f", s->raw, s->weighted, s->median, s->percentile,
                        s->largest);
        kmp_text_printf(text, isfinite(s->sperling) ? "  %5.3f\n" : "      -\n", s->sperling);
    }
    kmp_text_put(text, c->places > 0 ? "\n" : "");
    for (int k = 0; k < c->places; k++)
        kmp_text_printf(text, "mean comfort N_MV  %.3f  at '%s'\n", kempe_comfort_mean_comfort(c, k),
                        kmp_comfort_signal_of(c, KMP_COMFORT_VERTICAL, k)->name);
    kmp_text_printf(text, "\nsamples   %g per second; with every other one values differ by at most %.1e (relative)\n",
                    c->rate, worst(c));
    if (c->windows < KMP_COMFORT_WINDOWS)
        kmp_text_printf(text, "note      EN 12299 takes the percentile of %d windows, 5 min\n", KMP_COMFORT_WINDOWS);
}

static void json(kmp_text *text, const void *result)
{
    const kempe_comfort *c = result;
    kmp_json j = kmp_json_begin(text);
    kmp_print_head(&j, c->system, kmp_status_word(c->status), "", 0, c->warnings);
    kmp_json_put(&j, "from %g windows %d window %g rate %g difference %g signals [", c->from, c->windows,
                 KMP_COMFORT_WINDOW, c->rate, worst(c));
    for (int k = 0; k < c->count; k++) {
        const kmp_comfort_signal *s = &c->signal[k];
        const kmp_comfort_row *row = &kmp_comfort_rows[s->direction];
        kmp_json_put(&j, "{ direction %s name %s weighting %s rms %g weighted %g", row->name, s->name,
                     kmp_weighting_name(row->weighting), s->raw, s->weighted);
        kmp_json_put(&j, "median %g percentile_95 %g largest %g Wz %g difference %g", s->median, s->percentile,
                     s->largest, s->sperling, s->difference);
        kmp_json_numbers(&j, "windows", c->windows, s->window);
        kmp_json_end(&j);
    }
    kmp_json_put(&j, "] mean_comfort [");
    for (int k = 0; k < c->places; k++)
        kmp_json_number(&j, NULL, kempe_comfort_mean_comfort(c, k));
    kmp_json_put(&j, "] }");
}

KMP_PRINT(kempe_comfort, comfort, comfort->system->context, json, show)
