/* SPDX-License-Identifier: BSD-3-Clause */
/* Data of pages whose results are rows, states, instances or a run: words, curves, contacts, wheels, the model. */
#include "report/result_page.h"
#include "analyses/parts/series_summary.h"
#include "base/base64.h"
#include "base/file.h"
#include "base/memory.h"
#include "ensemble/statistics/statistics.h"
#include "model/data/closure.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/parameter.h"
#include "model/language/nearest.h"
#include "model/write/model_print.h"
#include "model/write/model_show.h"
#include "output/print.h"
#include "output/result_table.h"
#include "report/vehicle_drawing.h"
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

/* Numbers of all curves, rows of one curve; the text of the files beyond this is cut. They keep the page below 3 MB. */
enum { MOST_NUMBERS = 100000, MOST_ROWS = 2001, FEWEST_ROWS = 101, MOST_TEXT = 60000 };

/* -- curves ------------------------------------------------------------------------------------------ */

/* Rows that are drawn: rows at this stride, and the last. */
static int choose_stride(int rows, int most)
{
    most = most > MOST_ROWS ? MOST_ROWS : most < FEWEST_ROWS ? FEWEST_ROWS : most;
    return rows > most ? (rows + most - 2) / (most - 1) : 1;
}

bool kmp_page_is_first(const kmp_page_curves *curves, int column)
{
    const char *name = kempe_table_column_name(curves->table, column);
    bool first = strcmp(name, curves->x) == 0;
    for (int k = 0; k < curves->first_count && !first; k++)
        first = strcmp(name, curves->first[k]) == 0;
    return first;
}

/* Strides of the curves that are drawn at first, and of the others: a multiple. */
typedef struct strides {
    int first, other;
} strides;

/* Thins a column into room; returns the number of values. */
static int thin(int rows, int stride, const double *values, double *room)
{
    int count = 0;
    for (int k = 0; k < rows; k += stride)
        room[count++] = values[k];
    if (rows > 0 && (rows - 1) % stride != 0)
        room[count++] = values[rows - 1];
    return count;
}

/* Of points mean and root mean square are those over their number; without any all are unknown. */
static kmp_series_summary summary_of_points(int rows, const double *x, const double *y)
{
    kmp_series_summary s = kmp_series_summarise(rows, x, y, 1);
    double sum = 0, squares = 0;
    int count = 0;
    for (int k = 0; k < rows; k++)
        if (isfinite(y[k])) {
            sum += y[k];
            squares += y[k] * y[k];
            count++;
        }
    s.mean = count > 0 ? sum / count : NAN;
    s.rms = count > 0 ? sqrt(squares / count) : NAN;
    return s;
}

static void put_summary(kmp_json *json, const kmp_page_curves *curves, const double *x, int column)
{
    const double *y = kempe_table_values(curves->table, column);
    int all = kempe_table_row_count(curves->table), rows = curves->locked && all > 2 ? all - 1 : all;
    bool points = curves->scattered || kmp_table_has_points(curves->table, column);
    kmp_series_summary s = points ? summary_of_points(rows, x, y) : kmp_series_summarise(rows, x, y, 1);
    const double numbers[] = {s.low, s.low_at, s.high, s.high_at, s.mean, s.rms};
    kmp_json_rounded_numbers(json, "summary", sizeof numbers / sizeof *numbers, numbers, 7);
}

static void put_columns(kmp_json *json, const kmp_page_curves *curves, int x, strides stride, double *room)
{
    const kempe_table *table = curves->table;
    int rows = kempe_table_row_count(table), columns = kempe_table_column_count(table);
    for (int c = 0; c < columns; c++) {
        const double *values = kempe_table_values(table, c);
        if (!values)
            continue;
        bool whole = kmp_page_is_first(curves, c) || kmp_table_has_points(table, c);
        int every = whole ? stride.first : stride.other, count = thin(rows, every, values, room);
        kmp_json_put(json, "{ name %s unit %s every %d", kempe_table_column_name(table, c), kempe_table_unit(table, c),
                     every / stride.first);
        /* Points have the name of the column whose curve they belong to. */
        int curve = kmp_table_curve_of(table, c);
        if (kmp_table_has_points(table, c))
            kmp_json_put(json, "look %s of %s",
                         kmp_table_column_look(table, c) == KMP_LOOK_POINTS ? "points" : "residuals",
                         curve >= 0 ? kempe_table_column_name(table, curve) : "");
        put_summary(json, curves, kempe_table_values(table, x), c);
        kmp_json_floats(json, "values", (size_t)count, room);
        kmp_json_end(json);
    }
}

/* The columns of an earlier run that the table has, too, in its units. */
static void put_earlier(kmp_json *json, const kmp_page_curves *curves, double *room)
{
    const kempe_table *earlier = curves->earlier;
    const int rows = kempe_table_row_count(earlier), columns = kempe_table_column_count(earlier);
    const int stride = choose_stride(rows, MOST_NUMBERS / 2 / (curves->first_count + 1));
    kmp_json_put(json, "earlier { name %s columns [", kempe_table_name(earlier));
    for (int c = 0; c < columns; c++) {
        const int own = kempe_table_find(curves->table, kempe_table_column_name(earlier, c));
        if (own < 0 || !kmp_page_is_first(curves, own))
            continue;
        int count = 0;
        for (int row = 0; row < rows; row += stride)
            room[count++] = kmp_table_in_unit_of(curves->table, own, earlier, row, c);
        kmp_json_put(json, "{ name %s", kempe_table_column_name(earlier, c));
        kmp_json_floats(json, "values", (size_t)count, room);
        kmp_json_end(json);
    }
    kmp_json_put(json, "] }");
}

/* Of rows that are all drawn. */
static void put_joins(kmp_json *json, const kmp_page_curves *curves, int rows, bool whole)
{
    if (!curves->joins || !whole) {
        kmp_json_string(json, "joins", NULL);
        return;
    }
    kmp_json_array(json, "joins");
    for (int k = 0; k < rows; k++)
        kmp_json_number(json, NULL, curves->joins[k]);
    kmp_json_end(json);
}

static void put_series(kmp_json *json, const kmp_page_curves *curves)
{
    const kempe_table *table = curves->table;
    int x = table && curves->x ? kempe_table_find(table, curves->x) : -1,
        rows = table ? kempe_table_row_count(table) : 0;
    const int most = curves->earlier ? kempe_table_row_count(curves->earlier) : 0;
    double *room = x >= 0 && rows > 0 ? KMP_NEW(double, rows > most ? rows : most) : NULL;
    json->text->failed = json->text->failed || (x >= 0 && rows > 0 && !room);
    if (!room) {
        kmp_json_string(json, "series", NULL);
        return;
    }
    const int columns = kempe_table_column_count(table), first = curves->first_count + 1, others = columns - first;
    const int each = choose_stride(rows, MOST_NUMBERS / 2 / first), drawn = (rows - 1) / each + 1;
    const int more = others > 0 ? choose_stride(drawn, (MOST_NUMBERS - first * drawn) / others) : 1;
    const strides stride = {each, each * more};
    kmp_json_put(
        json, "series { x %s logarithmic %i scattered %i rows %d stride %d drawn %d left_out %d requested %d first [",
        curves->x, curves->logarithmic, curves->scattered, rows, stride.first,
        thin(rows, stride.first, kempe_table_values(table, x), room), curves->left_out, curves->requested);
    for (int k = 0; k < curves->first_count; k++)
        kmp_json_string(json, NULL, curves->first[k]);
    kmp_json_put(json, "] columns [");
    put_columns(json, curves, x, stride, room);
    kmp_json_put(json, "]");
    if (curves->earlier)
        put_earlier(json, curves, room);
    else
        kmp_json_string(json, "earlier", NULL);
    put_joins(json, curves, rows, stride.first == 1);
    kmp_json_end(json);
    kmp_free(room);
}

/* -- where a run stopped ----------------------------------------------------------------------------- */

/* The joint or closure that a name in a message means: itself, or the joint of a coordinate, a drive or a row. NULL: it
 * is none. */
static const char *part_named(const kempe_model *model, const char *name)
{
    for (int k = 0; k < model->motion_count; k++)
        if (strcmp(model->motions[k].name, name) == 0)
            return model->bodies[model->motions[k].body].joint;
    for (int k = 1; k < model->body_count; k++)
        if (model->bodies[k].joint && strcmp(model->bodies[k].joint, name) == 0)
            return model->bodies[k].joint;
    for (int k = 0; k < model->closure_count; k++) {
        const kmp_closure *c = &model->closures[k];
        size_t length = strlen(c->name);
        bool row = strncmp(name, c->name, length) == 0 && (!name[length] || name[length] == '.');
        if (row)
            return kmp_closure_is_drive(c) ? model->bodies[model->motions[c->motion].body].joint : c->name;
    }
    int force = kmp_name_find(KMP_NAMED(model, force), name), motion = force >= 0 ? model->forces[force].motion : -1;
    return motion >= 0  ? model->bodies[model->motions[motion].body].joint
           : force >= 0 ? model->forces[force].name
                        : NULL;
}

/* Names in a sentence are in single quotes. */
static int put_named(kmp_json *json, const kempe_model *model, const char *sentence)
{
    const char *last = NULL;
    int count = 0;
    for (const char *s = strchr(sentence, '\''); s; s = strchr(s + 1, '\'')) {
        char name[128];
        size_t length = strcspn(s + 1, "'");
        if (!s[1 + length])
            break;
        (void)snprintf(name, sizeof name, "%.*s", (int)length, s + 1);
        const char *part = part_named(model, name);
        if (part && ++count && part != last)
            kmp_json_string(json, NULL, part);
        last = part ? part : last;
        s += part ? length : 0; /* an apostrophe begins no name */
    }
    return count;
}

/* -- the model --------------------------------------------------------------------------------------- */

/* Takes its length, if there is so much room, from what may follow. */
static void put_file(kmp_json *json, const char *name, char *text, size_t length, size_t *room)
{
    bool cut = length > *room;
    kmp_json_put(json, "{ name %s cut %i", name, cut);
    if (cut)
        text[*room] = '\0';
    *room -= cut ? *room : length;
    kmp_json_put(json, "text %s }", text);
}

/* A file that is included several times is shown once. */
static bool is_first_of_name(const kempe_model *model, int file)
{
    for (int k = 0; model->source.files[file] && k < file; k++)
        if (model->source.files[k] && strcmp(model->source.files[k], model->source.files[file]) == 0)
            return false;
    return model->source.files[file];
}

/* The files that the model was read from; where they are none, or cannot be read any more, the model as it is printed.
 */
static void put_files(kmp_json *json, const kempe_model *model)
{
    int count = 0;
    size_t room = MOST_TEXT;
    kmp_json_array(json, "files");
    for (int k = 0; k < model->source.file_count; k++) {
        char *text = NULL;
        size_t length = 0;
        if (is_first_of_name(model, k) &&
            kmp_file_read(model->context, KMP_FILE_INCLUDED, model->source.files[k], &text, &length) == KEMPE_OK &&
            ++count)
            put_file(json, model->source.files[k], text, length, &room);
        kmp_free(text);
    }
    kmp_context_clear(model->context);
    kmp_text shown = {0};
    if (count == 0)
        kmp_model_show(&shown, model);
    if (shown.s)
        put_file(json, model->name, shown.s, shown.length, &room);
    kmp_text_free_part(json->text, &shown);
    kmp_json_end(json);
}

/* The bodies whose colours curves have, by the names of joints, coordinates, and drives and forces of joints. */
static void put_owners(kmp_json *json, const kempe_model *model)
{
    kmp_json_object(json, "owners");
    for (int k = 0; k < model->closure_count; k++)
        if (kmp_closure_is_drive(&model->closures[k]))
            kmp_json_whole(json, model->closures[k].name, model->motions[model->closures[k].motion].body);
    for (int k = 0; k < model->force_count; k++)
        if (model->forces[k].motion >= 0)
            kmp_json_whole(json, model->forces[k].name, model->motions[model->forces[k].motion].body);
    for (int k = 0; k < model->motion_count; k++)
        kmp_json_whole(json, model->motions[k].name, model->motions[k].body);
    for (int b = 1; b < model->body_count; b++)
        if (model->bodies[b].joint)
            kmp_json_whole(json, model->bodies[b].joint, b);
    kmp_json_end(json);
}

/* -- the page ---------------------------------------------------------------------------------------- */

static void put_words(kmp_json *json, const kmp_result_page *page)
{
    const char *word = kempe_outcome_text(page->head.outcome);
    kmp_text answer = {0};
    kmp_text_printf(&answer, "%c%s: %s", word[0] - 'a' + 'A', word + 1, page->head.answer);
    kmp_json_text(json, "answer", &answer);
    kmp_json_put(json, "warnings %s text %s facts [", page->head.warnings ? page->head.warnings : "",
                 page->head.text ? page->head.text : "");
    for (int k = 0; k < page->head.fact_count; k++)
        kmp_json_put(json, "{ name %s value %s limit %s beyond %i }", page->head.fact[k].name, page->head.fact[k].value,
                     page->head.fact[k].limit, page->head.fact[k].beyond);
    kmp_json_end(json);
}

/* The parts to be marked where a run did not reach its end: joints that the reason names, otherwise the joint with the
 * largest acceleration for its size at the last frame. */
static void put_stopped(kmp_json *json, const kmp_result_page *page)
{
    const kempe_system *system = page->system;
    const kmp_samples *rows = page->picture.frames;
    bool stopped = page->head.reason && !kmp_outcome_is_complete(page->head.outcome);
    kmp_json_array(json, "stopped_at");
    if (stopped && put_named(json, system->model, page->head.reason) == 0 &&
        page->head.outcome != KEMPE_OUTCOME_STOPPED && page->motion.run) {
        int best = -1;
        double most = 0;
        for (int k = 0; rows && rows->rows > 0 && k < rows->n; k++) {
            double size = fabs(kmp_samples_get(rows, KMP_QUANTITY_QDD, rows->rows - 1)[k]) / system->scale[k];
            if (size > most) {
                most = size;
                best = k;
            }
        }
        if (best >= 0)
            kmp_json_string(json, NULL, system->model->bodies[system->model->motions[best].body].joint);
    }
    kmp_json_end(json);
}

static void put_parameters(kmp_json *json, const kempe_model *model)
{
    kmp_json_array(json, "parameters");
    for (int k = 0; k < model->parameter_count; k++) {
        const kmp_parameter *p = &model->parameters[k];
        kmp_text words = {0};
        if (p->number.expr)
            kmp_model_put_expr(&words, model, p->number.expr);
        kmp_json_put(json, "{ name %s value %.9g", p->name, p->number.value);
        kmp_json_text(json, "expression", &words);
        kmp_json_end(json);
    }
    kmp_json_end(json);
    /* Each with the value of its default in its own unit. */
    kmp_json_array(json, "inputs");
    for (int k = 0; k < kmp_model_given_inputs(model); k++) {
        const kmp_model_input *input = &model->inputs[k];
        kmp_json_put(json, "{ name %s unit %s value %.9g samples %d }", input->name, input->unit,
                     input->value / input->si, input->signal.count);
    }
    kmp_json_end(json);
}

/* The table as columns with names and units, and rows of cells. */
static void put_table(kmp_json *json, const char *key, const kempe_table *table)
{
    const int columns = kempe_table_column_count(table);
    if (kempe_table_row_count(table) == 0) {
        kmp_json_string(json, key, NULL);
        return;
    }
    kmp_json_object(json, key);
    kmp_json_put(json, "columns [");
    for (int c = 0; c < columns; c++)
        kmp_json_string(json, NULL, kempe_table_column_name(table, c));
    kmp_json_put(json, "] units [");
    for (int c = 0; c < columns; c++)
        kmp_json_string(json, NULL, kempe_table_unit(table, c));
    kmp_json_put(json, "] rows [");
    for (int row = 0; row < kempe_table_row_count(table); row++) {
        kmp_json_array(json, NULL);
        for (int c = 0; c < columns; c++)
            if (kmp_table_has_words(table, c))
                kmp_json_string(json, NULL, kempe_table_word(table, row, c));
            else
                kmp_json_rounded(json, NULL, kempe_table_number(table, row, c), 7);
        kmp_json_end(json);
    }
    kmp_json_put(json, "] }");
}

static void put(kmp_result_page *page)
{
    kmp_json *json = &page->data;
    put_words(json, page);
    put_series(json, &page->curves);
    put_stopped(json, page);
    kmp_contact_drawing(json, page->motion.run, page->motion.run ? &page->motion.records->row : NULL);
    kmp_vehicle_drawing(json, page->motion.run, page->motion.comfort);
    put_owners(json, page->system->model);
    kmp_json_put(json, "separate %i locked %i", page->picture.separate, page->curves.locked);
    kmp_statistics_put(json, "statistics", page->statistics);
    put_table(json, "reactions", page->loads.reactions);
    if (page->loads.peaks[1] > page->loads.peaks[0])
        kmp_json_numbers(json, "reaction_peaks", 2, page->loads.peaks);
    if (kempe_table_row_count(page->loads.bearings) > 0)
        put_table(json, "bearings", page->loads.bearings);
    put_parameters(json, page->system->model);
    put_files(json, page->system->model);
}

static const char *const *const scripts[] = {kmp_records_js,         kmp_journal_paths_js, kmp_quantities_js,
                                             kmp_joint_reactions_js, kmp_force_arrows_js,  kmp_range_strip_js,
                                             kmp_running_vehicle_js, kmp_result_js,        NULL};
const kmp_page_view kmp_result_view = {kmp_result_html, scripts, put};
