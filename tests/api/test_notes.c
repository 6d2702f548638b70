/* SPDX-License-Identifier: BSD-3-Clause */
/* Notes of a run: a triple-rocker, whose coordinates all have dead centres, exchanges them. */
#include "check.h"
#include <kempe/table.h>
#include <string.h>

typedef struct listener {
    int lines;
    char last[256];
} listener;

static void listen(void *user, kempe_level level, const char *line)
{
    listener *l = user;
    if (level != KEMPE_LOG_NOTE)
        return;
    l->lines++;
    snprintf(l->last, sizeof l->last, "%s", line);
}

static void notes_are_kept_in_order(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *run = NULL;
    kempe_run_options settings = {0};
    listener heard = {0};
    char *text = NULL;
    kempe_table *notes = NULL;
    double before = 0;
    settings.t_end = 3;
    kempe_context_set_log(context, listen, &heard);
    CHECK(kempe_model_read(context, KEMPE_ROOT "/tests/models/triple_rocker.yaml", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_simulate(system, &settings, &run) == KEMPE_OK);
    CHECK(kempe_trajectory_table(run, "notes", &notes) == KEMPE_E_ARGUMENT && !notes);
    CHECK(kempe_trajectory_table(run, "events", &notes) == KEMPE_OK);
    int count = kempe_table_row_count(notes), words = kempe_table_find(notes, "text");
    CHECK(count > 4 && heard.lines == count);
    for (int k = 0; k < count; k++) {
        const char *note = kempe_table_word(notes, k, words);
        double t = kempe_table_number(notes, k, 0);
        CHECK(strstr(note, "instead of") && strstr(note, "|dv/du|"));
        CHECK(t > before && t < 3);
        CHECK(k < count - 1 || strstr(heard.last, note));
        before = t;
    }
    CHECK(kempe_trajectory_print(run, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\njournal   t = ") && strstr(text, kempe_table_word(notes, 0, words)));
    kempe_text_free(text);
    text = NULL;
    CHECK(kempe_trajectory_print(run, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"kind\": \"exchange\"") && strstr(text, kempe_table_word(notes, count - 1, words)));
    kempe_text_free(text);
    kempe_table_free(notes);
    kempe_trajectory_free(run);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(notes_are_kept_in_order);
    return check_report();
}
