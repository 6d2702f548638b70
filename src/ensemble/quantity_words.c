/* SPDX-License-Identifier: BSD-3-Clause */
/* A quantity is [NAME =] WORD(EXPRESSION) [from TIME [to TIME]], or an expression alone: its value at the end. */
#include "ensemble/quantity_words.h"
#include "base/memory.h"
#include "ensemble/added_values.h"
#include "model/data/model.h"
#include "model/language/nearest.h"
#include "output/print.h"
#include <ctype.h>
#include <math.h>
#include <string.h>

/* The words of quantities: the number of arguments, and whether the first one is a condition. */
static const struct {
    const char *word;
    kmp_run_quantity_kind kind;
    int arguments;
    bool condition;
} words[] = {{"max", KMP_TAKE_MAX, 1, false},     {"min", KMP_TAKE_MIN, 1, false},
             {"range", KMP_TAKE_RANGE, 1, false}, {"mean", KMP_TAKE_MEAN, 1, false},
             {"rms", KMP_TAKE_RMS, 1, false},     {"integral", KMP_TAKE_INTEGRAL, 1, false},
             {"at", KMP_TAKE_AT, 2, false},       {"first", KMP_TAKE_FIRST, 1, true},
             {"count", KMP_TAKE_COUNT, 1, true},  {"duration", KMP_TAKE_DURATION, 1, true}};

/* A part of a text; column: of its first character, from 1. */
typedef struct part {
    const char *s;
    size_t length;
    int column;
} part;

/* Lists under construction. */
typedef struct reading {
    kmp_quantity_list *list;
    kempe_context *context;
    kempe_model *copy;
    const char *label;
    const char *whole; /* text that columns belong to */
    kmp_run_quantity *of;
    kmp_added_value *channel;
    const char **name, **unit;
    int *shown;
} reading;

/* -- parts of texts ----------------------------------------------------------------------------------- */

static part trimmed(part p)
{
    for (; p.length > 0 && isspace((unsigned char)*p.s); p.s++, p.length--)
        p.column++;
    while (p.length > 0 && isspace((unsigned char)p.s[p.length - 1]))
        p.length--;
    return p;
}

static part part_of(part p, size_t from, size_t length)
{
    return trimmed((part){p.s + from, length, p.column + (int)from});
}

/* The first of `signs` outside parentheses; the length of the part: there is none. */
static size_t find_outside(part p, const char *signs)
{
    int depth = 0;
    for (size_t k = 0; k < p.length; k++) {
        depth += (p.s[k] == '(') - (p.s[k] == ')');
        if (depth == 0 && strchr(signs, p.s[k]))
            return k;
    }
    return p.length;
}

/* Takes the next item of a list, whose separators are outside parentheses; false after the last one. */
static bool next_item(part *rest, part *item)
{
    while (rest->length > 0) {
        size_t end = find_outside(*rest, ",;\n"), skip = end < rest->length ? end + 1 : end;
        *item = part_of(*rest, 0, end);
        *rest = (part){rest->s + skip, rest->length - skip, rest->column + (int)skip};
        if (item->length > 0)
            return true;
    }
    return false;
}

static part whole_of(const char *text)
{
    return (part){text, text ? strlen(text) : 0, 1};
}

static int count_items(const char *text)
{
    part rest = whole_of(text), item;
    int count = 0;
    while (next_item(&rest, &item))
        count++;
    return count;
}

/* Hands each item of a list to `add`; `label` names the list in messages. */
static kempe_status each_item(reading *r, const char *text, const char *label,
                              kempe_status (*add)(reading *r, part item))
{
    part rest = whole_of(text), item;
    r->label = label;
    while (next_item(&rest, &item))
        KMP_TRY(add(r, item));
    return KEMPE_OK;
}

static const char *copy_of(reading *r, part p)
{
    return kmp_arena_printf(&r->list->arena, "%.*s", (int)p.length, p.s);
}

static kempe_status complain(const reading *r, part p, const char *sentence)
{
    return kmp_fail(r->context, KEMPE_E_ARGUMENT, "%s:1:%d: '%.*s': %s", r->label, p.column, (int)p.length, p.s,
                    sentence);
}

/* -- quantities --------------------------------------------------------------------------------------- */

/* Splits "NAME = REST": an equals sign that is no part of a comparison. */
static part take_name(part *item)
{
    size_t n = 0;
    while (n < item->length && (isalnum((unsigned char)item->s[n]) || strchr("_.-", item->s[n])))
        n++;
    part name = part_of(*item, 0, n);
    while (n < item->length && item->s[n] == ' ')
        n++;
    if (name.length == 0 || n >= item->length || item->s[n] != '=')
        return *item;
    *item = part_of(*item, n + 1, item->length - n - 1);
    return name;
}

/* The row of words that an item begins with, and its arguments; -1: it is an expression. */
static int find_word(part item, part *inside)
{
    const int count = (int)(sizeof words / sizeof *words);
    size_t open = 0;
    while (open < item.length && isalpha((unsigned char)item.s[open]))
        open++;
    if (open == item.length || item.s[open] != '(' || item.s[item.length - 1] != ')')
        return -1;
    const part behind = {item.s + open, item.length - open, item.column + (int)open};
    if (find_outside(behind, ")") != behind.length - 1)
        return -1;
    const part within = part_of(item, open + 1, item.length - open - 2);
    for (int k = 0; k < count; k++) {
        bool same = strlen(words[k].word) == open && strncmp(words[k].word, item.s, open) == 0;
        if (!same || (words[k].arguments == 1 && find_outside(within, ",") < within.length))
            continue;
        *inside = within;
        return k;
    }
    return -1;
}

/* The channel of a text, which other quantities may share. */
static kempe_status find_channel(reading *r, part text, bool condition, int *channel)
{
    kmp_run_quantities *run = &r->list->run;
    if (text.length == 0)
        return complain(r, text, "an expression is missing");
    for (int k = 0; k < run->channels; k++)
        if (r->channel[k].condition == condition && strlen(r->channel[k].text) == text.length &&
            strncmp(r->channel[k].text, text.s, text.length) == 0) {
            *channel = k;
            return KEMPE_OK;
        }
    *channel = run->channels++;
    r->channel[*channel] = (kmp_added_value){.text = copy_of(r, text), .column = text.column, .condition = condition};
    return kmp_made(r->context, r->channel[*channel].text);
}

static kempe_status read_time(reading *r, part text, double *time)
{
    const char *s = copy_of(r, text);
    KMP_TRY(kmp_made(r->context, s));
    KMP_TRY(kmp_added_number(r->copy, r->label, s, text.column, "the time", KMP_DIM_TIME, time));
    if (*time < 0)
        return complain(r, text, "the time must not be negative");
    r->list->last_time = fmax(r->list->last_time, *time);
    return KEMPE_OK;
}

/* The place of a word between spaces outside parentheses; the length of the text: there is none. */
static size_t find_apart(part p, const char *word)
{
    size_t length = strlen(word);
    int depth = 0;
    for (size_t k = 0; k + length < p.length; k++) {
        depth += (p.s[k] == '(') - (p.s[k] == ')');
        if (depth == 0 && k > 0 && isspace((unsigned char)p.s[k - 1]) && strncmp(p.s + k, word, length) == 0 &&
            isspace((unsigned char)p.s[k + length]))
            return k;
    }
    return p.length;
}

/* Takes "from TIME" or "from TIME to TIME" from the end of an item. */
static kempe_status take_span(reading *r, part *item, kmp_run_quantity *q)
{
    enum { FROM = 4, TO = 2 };
    const part written = *item;
    size_t from = find_apart(written, "from");
    if (from == written.length)
        return KEMPE_OK;
    const part behind = part_of(written, from + FROM, written.length - from - FROM);
    size_t to = find_apart(behind, "to");
    bool ends = to < behind.length;
    *item = part_of(written, 0, from);
    part inside;
    int row = find_word(*item, &inside);
    if (row < 0 || words[row].kind == KMP_TAKE_AT)
        return complain(r, written,
                        "a span of time is for max(..), min(..), range(..), mean(..), rms(..), integral(..), "
                        "first(..), count(..) or duration(..)");
    q->spanned = true;
    q->end = INFINITY;
    KMP_TRY(read_time(r, part_of(behind, 0, to), &q->begin));
    if (ends)
        KMP_TRY(read_time(r, part_of(behind, to + TO, behind.length - to - TO), &q->end));
    return q->end > q->begin ? KEMPE_OK : complain(r, written, "the span ends before it begins");
}

static int value_named(const reading *r, part name)
{
    for (int k = 0; k < r->list->run.values; k++)
        if (strlen(r->name[k]) == name.length && strncmp(r->name[k], name.s, name.length) == 0)
            return k;
    return -1;
}

static kempe_status add_quantity(reading *r, part item)
{
    kmp_run_quantities *run = &r->list->run;
    const part written = item, name = take_name(&item);
    kmp_run_quantity q = {.first_value = run->values};
    KMP_TRY(take_span(r, &item, &q));
    part inside = item;
    int row = find_word(item, &inside);
    q.kind = row < 0 ? KMP_TAKE_END : words[row].kind;
    if (value_named(r, name) >= 0)
        return complain(r, written, "a quantity of this name is there already");
    if (q.kind == KMP_TAKE_AT) {
        size_t comma = find_outside(inside, ",");
        if (comma == inside.length)
            return complain(r, written, "at(EXPRESSION, TIME) is expected");
        KMP_TRY(read_time(r, part_of(inside, comma + 1, inside.length - comma - 1), &q.time));
        inside = part_of(inside, 0, comma);
    }
    KMP_TRY(find_channel(r, inside, row >= 0 && words[row].condition, &q.channel));
    r->name[run->values++] = copy_of(r, name);
    if (kmp_run_quantity_width(q.kind) == 2) {
        r->name[run->values] = kmp_arena_printf(&r->list->arena, "%.*s.time", (int)name.length, name.s);
        run->values++;
    }
    r->of[run->count++] = q;
    return kmp_made(r->context, !r->list->arena.failed);
}

/* -- limits ------------------------------------------------------------------------------------------- */

static kempe_status add_limit(reading *r, part item)
{
    kmp_quantity_list *list = r->list;
    size_t sign = find_outside(item, "<>");
    if (sign == item.length)
        return complain(r, item, "QUANTITY < VALUE is expected, or one of <=, >, >=");
    bool or_equal = sign + 1 < item.length && item.s[sign + 1] == '=';
    size_t behind = sign + 1 + or_equal;
    part left = part_of(item, 0, sign), right = part_of(item, behind, item.length - behind);
    int value = value_named(r, left);
    if (value < 0) {
        value = list->run.values;
        KMP_TRY(add_quantity(r, left));
    }
    const char *bound = copy_of(r, right);
    kmp_quantity_limit *limit = &list->limit[list->limit_count++];
    *limit = (kmp_quantity_limit){
        .text = copy_of(r, item), .value = value, .sign = item.s[sign] == '<' ? 1 : -1, .or_equal = or_equal};
    KMP_TRY(kmp_made(r->context, bound && limit->text));
    return kmp_added_number(r->copy, r->label, bound, right.column, "the limit", KMP_DIM_ANY, &limit->bound);
}

bool kmp_limit_holds(const kmp_quantity_limit *limit, double value)
{
    double over = limit->sign * (value - limit->bound);
    return limit->or_equal ? over <= 0 : over < 0;
}

/* -- all ---------------------------------------------------------------------------------------------- */

static const char *unit_of(reading *r, const kmp_run_quantity *q, int number)
{
    const char *unit = r->channel[q->channel].unit;
    if (number > 0 || q->kind == KMP_TAKE_FIRST || q->kind == KMP_TAKE_DURATION)
        return "s";
    if (q->kind == KMP_TAKE_COUNT)
        return "";
    return q->kind == KMP_TAKE_INTEGRAL && *unit ? kmp_arena_printf(&r->list->arena, "%s s", unit)
           : q->kind == KMP_TAKE_INTEGRAL        ? "s"
                                                 : unit;
}

/* Arguments are the channels behind those of the quantities. */
static bool add_arguments(reading *r, const kmp_added_arguments *arguments)
{
    kmp_run_quantities *run = &r->list->run;
    kmp_run_argument *argument = KMP_ARENA_NEW(&r->list->arena, kmp_run_argument, arguments->count);
    int *shown = KMP_ARENA_NEW(&r->list->arena, int, run->channels + arguments->count);
    if (!argument || !shown)
        return false;
    memcpy(shown, r->shown, (size_t)run->channels * sizeof *shown);
    for (int k = 0; k < arguments->count; k++) {
        const kmp_added_argument *a = &arguments->of[k];
        argument[k] = (kmp_run_argument){a->kind, a->of};
        shown[run->channels + k] = a->shown;
    }
    run->channels += arguments->count;
    run->arguments = arguments->count;
    run->turns = arguments->turns;
    run->argument = argument;
    run->shown = shown;
    r->list->argument_outputs = arguments->outputs;
    return true;
}

static kempe_status read_all(kmp_quantity_list *list, const kempe_model *model, const char *quantities,
                             const char *limits)
{
    int most_limits = count_items(limits), most = count_items(quantities) + most_limits;
    if (most == 0)
        return KEMPE_OK;
    KMP_TRY(kmp_variant_new(model, 0, NULL, &list->variant));
    reading r = {.list = list, .context = model->context, .copy = kmp_variant_model(list->variant)};
    KMP_TRY(kmp_made(model->context,
                     KMP_ARENA_MAKE(&list->arena, KMP_ROOM(kmp_run_quantity, most, &r.of),
                                    KMP_ROOM(kmp_added_value, most, &r.channel), KMP_ROOM(int, most, &r.shown),
                                    KMP_ROOM(const char *, 2 * most, &r.name, &r.unit),
                                    KMP_ROOM(kmp_quantity_limit, most_limits, &list->limit))));
    KMP_TRY(each_item(&r, quantities, "quantity", add_quantity));
    KMP_TRY(each_item(&r, limits, "limit", add_limit));
    kmp_added_arguments arguments;
    KMP_TRY(kmp_add_values(r.copy, "quantity", list->run.channels, r.channel, &arguments));
    kmp_run_quantities *run = &r.list->run;
    for (int k = 0; k < run->count; k++) {
        kmp_run_quantity *q = &r.of[k];
        q->or_equal = r.channel[q->channel].or_equal;
        run->inside = run->inside || kmp_run_quantity_inside(q->kind);
        for (int i = 0; i < kmp_run_quantity_width(q->kind); i++)
            r.unit[q->first_value + i] = unit_of(&r, q, i);
    }
    for (int k = 0; k < run->channels; k++) {
        r.shown[k] = r.channel[k].shown;
        run->rates = run->rates || r.channel[k].rates;
        run->late = run->late || r.channel[k].late;
        run->computed = run->computed || r.shown[k] >= 0;
    }
    run->of = r.of;
    run->name = r.name;
    r.list->name = r.name;
    r.list->unit = r.unit;
    return kmp_made(model->context, add_arguments(&r, &arguments) && !list->arena.failed);
}

kempe_status kmp_quantity_list_init(kmp_quantity_list *list, const kempe_model *model, const char *quantities,
                                    const char *limits)
{
    *list = (kmp_quantity_list){0};
    list->words = kmp_arena_strdup(&list->arena, quantities ? quantities : "");
    list->limit_words = kmp_arena_strdup(&list->arena, limits ? limits : "");
    kempe_status status = kmp_made(model->context, !list->arena.failed);
    if (status == KEMPE_OK)
        status = read_all(list, model, quantities, limits);
    if (status != KEMPE_OK)
        kmp_quantity_list_free(list);
    return status == KEMPE_E_ARGUMENT ? KEMPE_E_INPUT : status; /* the texts are read as files are, with places */
}

KMP_CLEARS(kmp_quantity_list, list, kmp_variant_free(list->variant), kmp_arena_free(&list->arena))
