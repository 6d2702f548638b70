/* SPDX-License-Identifier: BSD-3-Clause */
/* The log of a run: a triple-rocker, whose coordinates all have dead centres, exchanges them. */
#include "testing.h"
#include <kempe/table.h>
#include <string.h>

typedef struct listener {
    int lines;
    char last[256];
} listener;

static void listen(void *user, kempe_level level, const char *line)
{
    listener *l = user;
    if (level != KEMPE_LOG_INFO)
        return;
    l->lines++;
    snprintf(l->last, sizeof l->last, "%s", line);
}

static void entries_are_kept_in_order(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *run = NULL;
    kempe_run_options settings = {0};
    listener heard = {0};
    char *text = NULL;
    kempe_table *entries = NULL;
    double before = 0;
    settings.t_end = 3;
    settings.formulation = "reduced"; /* the default leaves them for the projected one */
    kempe_context_set_log(context, listen, &heard);
    CHECK(kempe_model_read(context, KEMPE_ROOT "/tests/models/triple_rocker.yaml", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_simulate(system, &settings, &run) == KEMPE_OK);
    CHECK(kempe_trajectory_table(run, "journal", &entries) == KEMPE_E_ARGUMENT && !entries);
    CHECK(kempe_trajectory_table(run, "log", &entries) == KEMPE_OK);
    int count = kempe_table_row_count(entries), words = kempe_table_find(entries, "text");
    CHECK(count > 4 && heard.lines == count);
    for (int k = 0; k < count; k++) {
        const char *line = kempe_table_word(entries, k, words);
        double t = kempe_table_number(entries, k, 0);
        CHECK(strstr(line, "instead of") && strstr(line, "|dv/du|"));
        CHECK(t > before && t < 3);
        CHECK(k < count - 1 || strstr(heard.last, line));
        before = t;
    }
    CHECK(kempe_trajectory_print(run, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\nlog       t = ") && strstr(text, kempe_table_word(entries, 0, words)));
    kempe_text_free(text);
    text = NULL;
    CHECK(kempe_trajectory_print(run, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"kind\": \"exchange\"") && strstr(text, kempe_table_word(entries, count - 1, words)));
    kempe_text_free(text);
    kempe_table_free(entries);
    kempe_trajectory_free(run);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(entries_are_kept_in_order);
    return check_report();
}
