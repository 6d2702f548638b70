/* SPDX-License-Identifier: BSD-3-Clause */
/* Notes of a run: a triple-rocker, whose coordinates all have dead centres, exchanges them. */
#include "check.h"
#include <kempe/kempe.h>
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
    kempe_run_options settings = kempe_run_options_default();
    listener heard = {0};
    char *text = NULL;
    double t = 0, before = 0;
    settings.t_end = 3;
    kempe_context_set_log(context, listen, &heard);
    CHECK(kempe_model_read(context, KEMPE_ROOT "/tests/models/triple_rocker.yaml", &model) == KEMPE_OK);
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(kempe_simulate(system, &settings, &run) == KEMPE_OK);
    int count = kempe_trajectory_note_count(run);
    CHECK(count > 4 && heard.lines == count);
    for (int k = 0; k < count; k++, before = t) {
        const char *note = kempe_trajectory_note(run, k, &t);
        CHECK(note && strstr(note, "instead of") && strstr(note, "|dv/du|"));
        CHECK(t > before && t < 3);
        CHECK(k < count - 1 || strstr(heard.last, note));
    }
    CHECK(!kempe_trajectory_note(run, -1, NULL) && !kempe_trajectory_note(run, count, &t));
    CHECK(kempe_trajectory_print(run, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\njournal   t = ") && strstr(text, kempe_trajectory_note(run, 0, NULL)));
    kempe_text_free(text);
    text = NULL;
    CHECK(kempe_trajectory_print(run, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"kind\": \"exchange\"") && strstr(text, kempe_trajectory_note(run, count - 1, NULL)));
    kempe_text_free(text);
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
