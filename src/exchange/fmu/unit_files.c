/* SPDX-License-Identifier: BSD-3-Clause */
/* The table of the unit in C, and its page. */
#include "exchange/fmu/unit_files.h"
#include "backend/time_scales.h"
#include "exchange/code/write.h"
#include "exchange/simulator/kempe_fmu.h"
#include "model/data/run_settings.h"
#include <stdio.h>

double kmp_unit_rtol(const kempe_model *model)
{
    return kmp_model_run(model)->rtol > 0 ? kmp_model_run(model)->rtol : 1e-8;
}

double kmp_unit_atol(const kempe_model *model)
{
    return kmp_model_run(model)->atol > 0 ? kmp_model_run(model)->atol : kmp_unit_rtol(model);
}

double kmp_unit_longest_step(const kempe_model *model)
{
    return kmp_model_run(model)->max_step > 0 ? kmp_model_run(model)->max_step : kmp_time_scales_shortest(model);
}

void kmp_unit_token(char token[KMP_UNIT_TOKEN], const kmp_unit_plan *plan)
{
    if (plan->on_library)
        (void)snprintf(token, KMP_UNIT_TOKEN, "kempe-" KEMPE_VERSION "-%s-library", plan->source->hash);
    else
        (void)snprintf(token, KMP_UNIT_TOKEN, "kempe-" KEMPE_VERSION "-%s-fmi%d%s%s", plan->source->hash, plan->fmi,
                       plan->exchange ? "-me" : "", plan->simulation ? "-cs" : "");
}

void kmp_unit_table(kmp_text *text, const kmp_unit_plan *plan)
{
    const kmp_code_source *s = plan->source;
    kmp_text_printf(text,
                    "/* The unit of the model %s, written by Kempe " KEMPE_VERSION ". */\n"
                    "#include \"%s_simulator.h\"\n#include \"kempe_fmu.h\"\n\n"
                    "const kempe_fmu_model kempe_fmu_exported = {&%s_equations, \"%s\", %s, ",
                    s->hash, s->name, s->name, plan->token,
                    !plan->simulation ? "KEMPE_FMU_MODEL_EXCHANGE"
                    : !plan->exchange ? "KEMPE_FMU_CO_SIMULATION"
                                      : "KEMPE_FMU_MODEL_EXCHANGE | KEMPE_FMU_CO_SIMULATION");
    kmp_language_number(text, &kmp_language_c, kmp_unit_rtol(s->model));
    kmp_text_put(text, ", ");
    kmp_language_number(text, &kmp_language_c, kmp_unit_atol(s->model));
    kmp_text_put(text, ", ");
    kmp_language_number(text, &kmp_language_c, kmp_unit_longest_step(s->model));
    kmp_text_put(text, ", NULL, NULL};\n");
}

/* A list of names in a cell of a table. */
static void put_list(kmp_text *html, const char *title, int count, char *const *names)
{
    kmp_text_printf(html, "<tr><th>%s</th><td>", title);
    for (int k = 0; k < count; k++) {
        kmp_text_put(html, k ? ", " : "");
        kmp_text_escape(html, names[k]);
    }
    kmp_text_printf(html, "%s</td></tr>\n", count ? "" : "none");
}

static void put_parameters(kmp_text *html, const kmp_code_source *s, bool fixed)
{
    int count = 0;
    kmp_text_printf(html, "<tr><th>%s</th><td>", fixed ? "fixed parameters" : "tunable parameters");
    for (int k = 0; k < s->parameter_count; k++)
        if ((s->simulated->fixed[k] != 0) == fixed) {
            kmp_text_put(html, count++ ? ", " : "");
            kmp_text_escape(html, s->parameter_name[k]);
        }
    kmp_text_printf(html, "%s</td></tr>\n", count ? "" : "none");
}

void kmp_unit_page(kmp_text *html, const kmp_unit_plan *plan)
{
    const kmp_code_source *s = plan->source;
    kmp_text_put(html, "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>");
    kmp_text_escape(html, s->title);
    kmp_text_put(html, "</title><style>body{font-family:sans-serif;max-width:50em;margin:2em auto}"
                       "th{text-align:left;vertical-align:top;padding-right:1em}</style></head>\n<body><h1>");
    kmp_text_escape(html, s->title);
    kmp_text_printf(
        html,
        "</h1>\n<p>A multibody mechanism as a functional mock-up unit (FMI %d.0), written by Kempe " KEMPE_VERSION
        " from the model %s. The unit closes the loops of the mechanism itself. %s</p>\n<table>\n",
        plan->fmi, s->hash,
        plan->on_library ? "Its binary contains the library of Kempe, and its resources contain the model."
                         : "Its sources are C99 and need no library.");
    if (!plan->on_library)
        kmp_text_printf(html, "<tr><th>degrees of freedom</th><td>%d</td></tr>\n", s->simulated->freedom);
    put_list(html, "coordinates", s->n, s->coordinate_names);
    put_list(html, "inputs", s->input_count, s->input_names);
    put_list(html, "outputs", s->output_count, s->output_names);
    put_parameters(html, s, true);
    put_parameters(html, s, false);
    if (!plan->on_library)
        put_list(html, "conditions of events", s->simulated->condition_count, s->simulated->condition_name);
    kmp_text_put(html, "</table>\n");
    if (!plan->on_library)
        kmp_text_put(
            html, "<h2>States</h2>\n<p>The states x are independent coordinates and their rates. The output choice has "
                  "the numbers of these coordinates. Where others become better, the unit requests an event and "
                  "exchanges them: "
                  "the number of states stays the same, and solver.exchanges counts.</p>\n");
    kmp_text_put(
        html,
        "<h2>Start</h2>\n<p>The start values of q and qd may be set before initialisation: the loops are closed near "
        "them. Parameters on which the loops depend are fixed after initialisation.</p>\n"
        "<h2>Inputs</h2>\n<p>An input that drives or other closures read has a value and two derivatives, with the "
        "endings "
        ".d and .dd, one whose rate a force reads the first of them; set them together with the "
        "value.</p>\n</body></html>\n");
}
