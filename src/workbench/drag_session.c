/* SPDX-License-Identifier: BSD-3-Clause */
/* Dragging by requests in JSON: each text of a model, with the files that it names, is prepared once, and the last few
 * are kept. */
#include "base/json.h"
#include "base/memory.h"
#include "language_server/json_value.h"
#include "model/data/model.h"
#include "platform/platform.h"
#include "workbench/dragging.h"
#include "workbench/message_lines.h"
#include <kempe/settings.h>
#include <kempe/workbench.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SESSIONS = 4, MOST_DRAGGED = 1000 };

/* A model with its prepared mechanism. */
typedef struct session {
    long number;        /* from 1 on; 0: none */
    long used;          /* the request that used it last */
    kempe_model *model; /* with the digest of its text and of all files that it names */
    kempe_system *system;
    kmp_dragging *dragging;
} session;

struct kempe_drag {
    kempe_context *context; /* not owned */
    char *file;
    char folder[KMP_PATH_MOST]; /* of the file, with its separator; "": the working folder */
    session sessions[MOST_SESSIONS];
    long last, requests; /* the last number that was given */
};

static void free_session(session *s)
{
    kmp_dragging_free(s->dragging);
    kempe_system_free(s->system);
    kempe_model_free(s->model);
    *s = (session){0};
}

kempe_status kempe_drag_new(kempe_context *context, const char *file, kempe_drag **drag)
{
    KMP_WANTED(NULL, context, "context");
    KMP_WANTED(context, file, "file");
    KMP_WANTED(context, drag, "drag");
    kmp_context_begin(context);
    KMP_MAKE(context, kempe_drag, d);
    d->context = context;
    d->file = kmp_strdup(file);
    (void)snprintf(d->folder, sizeof d->folder, "%.*s", (int)kmp_path_folder(file), file);
    const kempe_status status = kmp_made(context, d->file);
    return KMP_GIVE_OR_FREE(status, drag, d, kempe_drag_free);
}

void kempe_drag_free(kempe_drag *d)
{
    if (!d)
        return;
    for (int k = 0; k < MOST_SESSIONS; k++)
        free_session(&d->sessions[k]);
    kmp_free(d->file);
    kmp_free(d);
}

/* -- sessions ---------------------------------------------------------------------------------------- */

/* The mechanism of a session whose model has been read. */
static kempe_status prepare(kempe_drag *d, session *s)
{
    if (s->model->motion_count > MOST_DRAGGED)
        return kmp_fail(d->context, KEMPE_E_INPUT,
                        "a model of %d coordinates is too large to be dragged, which needs %d at most: run a study",
                        s->model->motion_count, MOST_DRAGGED);
    KMP_TRY(kempe_system_new_with_algorithm(s->model, "plain", &s->system));
    return kmp_dragging_new(s->system, &s->dragging);
}

static bool has_digest_of(const session *s, const kempe_model *model)
{
    return s->number > 0 && memcmp(s->model->source.digest, model->source.digest, sizeof model->source.digest) == 0;
}

/* The session of a text with all files that it names, made where there is none, in the place of the one that was not
 * used for the longest time. */
static kempe_status session_of_text(kempe_drag *d, const char *text, session **found)
{
    session made = {0}, *oldest = &d->sessions[0];
    KMP_TRY(kempe_context_set_text(d->context, d->file, text));
    KMP_TRY(kempe_model_read(d->context, d->file, &made.model));
    *found = NULL;
    for (session *s = d->sessions; s < d->sessions + MOST_SESSIONS; s++) {
        *found = has_digest_of(s, made.model) ? s : *found;
        oldest = s->used < oldest->used ? s : oldest;
    }
    kempe_status status = *found ? KEMPE_OK : prepare(d, &made);
    if (*found || status != KEMPE_OK) {
        free_session(&made);
        return status;
    }
    free_session(oldest);
    *oldest = made;
    oldest->number = ++d->last;
    *found = oldest;
    return KEMPE_OK;
}

static kempe_status session_of_number(kempe_drag *d, long number, session **found)
{
    for (session *s = d->sessions; s < d->sessions + MOST_SESSIONS; s++)
        if (number > 0 && s->number == number) {
            *found = s;
            return KEMPE_OK;
        }
    return kmp_fail(d->context, KEMPE_E_INPUT, "session %ld is not kept: send the text of the model again", number);
}

/* -- requests ---------------------------------------------------------------------------------------- */

static bool is_given(const kmp_json_value *value)
{
    return value && value->kind != KMP_JSON_NULL;
}

static bool read_number(const kmp_json_value *value, double *x)
{
    *x = value && value->kind == KMP_JSON_NUMBER ? strtod(value->text, NULL) : NAN;
    return isfinite(*x);
}

static kempe_status read_vector(kempe_drag *d, const kmp_json_value *request, const char *key, double x[3])
{
    const kmp_json_value *value = kmp_json_member(request, key);
    bool good = value && value->kind == KMP_JSON_ARRAY && value->count == 3;
    for (int k = 0; good && k < 3; k++)
        good = read_number(value->items[k], &x[k]);
    return good ? KEMPE_OK : kmp_fail(d->context, KEMPE_E_ARGUMENT, "'%s' is a list of three finite numbers, m", key);
}

/* Goes to the state that the request begins with. */
static kempe_status place(kempe_drag *d, session *s, const kmp_json_value *q, double *room, kmp_drag_report *report)
{
    const kempe_model *model = s->model;
    memcpy(room, s->dragging->start, (size_t)model->motion_count * sizeof *room);
    if (is_given(q) && q->kind != KMP_JSON_OBJECT)
        return kmp_fail(d->context, KEMPE_E_ARGUMENT, "'q' has numbers by the names of coordinates");
    for (int i = 0; is_given(q) && i < q->count; i++) {
        int k = model->motion_count - 1;
        while (k >= 0 && strcmp(model->motions[k].name, q->keys[i]) != 0)
            k--;
        if (k < 0)
            return kmp_fail(d->context, KEMPE_E_ARGUMENT, "'q': the model has no coordinate '%s'", q->keys[i]);
        if (!read_number(q->items[i], &room[k]))
            return kmp_fail(d->context, KEMPE_E_ARGUMENT, "'q': '%s' is not a finite number", q->keys[i]);
    }
    if (kmp_dragging_place(s->dragging, room, report))
        return KEMPE_OK;
    return kmp_fail(d->context, KEMPE_E_FAILED, "the loops cannot be closed near the coordinates 'q'");
}

static kempe_status move(kempe_drag *d, session *s, const kmp_json_value *request, kmp_drag_report *report)
{
    const char *name = kmp_json_word(request, "body");
    double point[3], target[3];
    int body = s->model->body_count - 1;
    if (!name)
        return kmp_fail(d->context, KEMPE_E_ARGUMENT, "'body' is the name of a body, or null");
    while (body > 0 && strcmp(s->model->bodies[body].name, name) != 0)
        body--;
    if (body <= 0)
        return kmp_fail(d->context, KEMPE_E_ARGUMENT, "the model has no body '%s' to be dragged", name);
    KMP_TRY(read_vector(d, request, "point", point));
    KMP_TRY(read_vector(d, request, "target", target));
    kmp_dragging_move(s->dragging, body, point, target, report);
    return KEMPE_OK;
}

/* -- answers ----------------------------------------------------------------------------------------- */

static void put_poses(kmp_json *json, const session *s)
{
    kmp_json_object(json, "poses");
    for (int b = 1; b < s->model->body_count; b++) {
        const kmp_pose *pose = &s->dragging->poses[b];
        kmp_json_object(json, s->model->bodies[b].name);
        kmp_json_numbers(json, "position", 3, pose->p);
        kmp_json_array(json, "rotation");
        for (int i = 0; i < 3; i++)
            kmp_json_numbers(json, NULL, 3, pose->r[i]);
        kmp_json_end(json);
        kmp_json_end(json);
    }
    kmp_json_end(json);
}

static void put_state(kmp_json *json, const session *s, const kmp_drag_report *report, bool moved)
{
    kmp_json_whole(json, "session", s->number);
    kmp_json_object(json, "q");
    for (int k = 0; k < s->model->motion_count; k++)
        kmp_json_number(json, s->model->motions[k].name, s->dragging->q[k]);
    kmp_json_end(json);
    kmp_json_whole(json, "freedoms", s->dragging->freedoms);
    kmp_json_number(json, "closure", report->closure);
    kmp_json_number(json, "distance", moved ? report->distance : NAN);
    if (report->mode < 0)
        kmp_json_string(json, "branch_changed", NULL);
    else
        kmp_json_boolean(json, "branch_changed", report->mode > 0);
    put_poses(json, s);
}

static kempe_status answer(kempe_drag *d, const kmp_json_value *request, kmp_json *json)
{
    session *s = NULL;
    kmp_drag_report report = {0};
    const char *text = kmp_json_word(request, "text");
    if (text && kmp_json_member(request, "text")->replaced)
        return kmp_fail(d->context, KEMPE_E_ARGUMENT, KMP_SERVED_NO_TEXT);
    const kmp_json_value *q = kmp_json_member(request, "q"), *body = kmp_json_member(request, "body");
    if (text)
        KMP_TRY(session_of_text(d, text, &s));
    else
        KMP_TRY(session_of_number(d, kmp_json_count(request, "session"), &s));
    const bool begins = s->used == 0, moves = is_given(body);
    s->used = ++d->requests;
    if (is_given(q) || begins || !is_given(kmp_json_member(request, "session"))) {
        double *room = KMP_NEW(double, s->model->motion_count + 1);
        kempe_status status = kmp_made(d->context, room);
        if (status == KEMPE_OK)
            status = place(d, s, q, room, &report);
        kmp_free(room);
        KMP_TRY(status);
    }
    if (moves)
        KMP_TRY(move(d, s, request, &report));
    else
        kmp_dragging_look(s->dragging, &report);
    put_state(json, s, &report, moves);
    return KEMPE_OK;
}

kempe_status kempe_drag_take(kempe_drag *d, const char *request, char **answered)
{
    KMP_WANTED(NULL, d, "drag");
    KMP_WANTED(d->context, request, "request");
    KMP_WANTED(d->context, answered, "answer");
    kmp_text out = {0};
    kmp_arena arena = {0};
    kmp_json json = kmp_json_begin_as(&out, KMP_JSON_DENSE);
    kmp_context_begin(d->context);
    const kmp_json_value *value = kmp_json_read(&arena, request, strlen(request));
    kmp_json_object(&json, NULL);
    kempe_status status = value && value->kind == KMP_JSON_OBJECT
                              ? answer(d, value, &json)
                              : kmp_fail(d->context, KEMPE_E_ARGUMENT, "the request is not an object of JSON in UTF-8");
    if (status != KEMPE_OK) {
        const char *message = kempe_context_message(d->context);
        kmp_json_string(&json, "error", message);
        kmp_put_messages(&json, message, d->folder);
    }
    kmp_json_end(&json);
    kmp_arena_free(&arena);
    *answered = kmp_text_take(&out);
    return *answered ? status : kmp_fail_memory(d->context);
}
