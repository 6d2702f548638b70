/* SPDX-License-Identifier: BSD-3-Clause */
/* Explanations of the word under the pointer: a key, a name, a function, a unit. */
#include "language_server/language_words.h"
#include "language_server/node_search.h"
#include "language_server/session.h"
#include "model/data/parameter.h"
#include "model/language/expression.h"
#include <string.h>

/* The value of a parameter, with its unit. */
static void put_value(kmp_text *text, const kempe_model *model, const char *name)
{
    for (int k = 0; model && k < kmp_model_parameter_count(model); k++) {
        const kmp_parameter *p = kmp_model_parameter(model, k);
        if (strcmp(p->name, name) != 0)
            continue;
        kmp_text_put(text, " = ");
        kmp_text_number(text, p->number.value);
        if (p->unit && *p->unit)
            kmp_text_printf(text, " %s", p->unit);
    }
}

/* The line of a declaration, without blanks around it. */
static void put_line(kmp_text *text, const char *source, size_t offset)
{
    size_t begin = kmp_line_begin(source, offset), length;
    begin += strspn(source + begin, " \t");
    length = strcspn(source + begin, "\r\n");
    kmp_text_put(text, "\n\n```yaml\n");
    kmp_text_append(text, source + begin, length);
    kmp_text_put(text, "\n```");
}

static void describe_name(const kmp_open_file *file, const kmp_declared *d, kmp_text *text)
{
    const char *owner = *d->owner ? d->owner : "";
    kmp_text_printf(text, "%s `%s%s%s`", kmp_name_rows[d->kind].word, owner, *owner ? "." : "", d->name);
    if (d->kind == KMP_NAME_PARAMETER)
        put_value(text, file->model, d->name);
    const char *slash = strrchr(d->source->path, '/');
    if (strcmp(d->source->path, file->path) != 0)
        kmp_text_printf(text, ", of %s", slash ? slash + 1 : d->source->path);
    kmp_text_printf(text, ", line %d", d->place.line);
    put_line(text, d->source->text, kmp_offset_of_place(d->source->text, d->place));
}

static void describe_key(const kmp_found_node *found, kmp_text *text)
{
    const kmp_schemas value = kmp_schema_of_key(&found->schemas, found->node->text);
    if (value.count > 0 && *value.one[0].meaning)
        kmp_text_printf(text, "**%s**: %s", found->node->text, value.one[0].meaning);
}

static void describe_word(const char *name, bool outputs, kmp_text *text)
{
    kmp_language_word word;
    for (int k = 0; kmp_language_word_at(k, &word); k++) {
        if (strcmp(word.name, name) != 0 || (word.kind == KMP_WORD_OUTPUT) != outputs)
            continue;
        kmp_text_printf(text, "%s**%s**", text->length > 0 ? "\n\n" : "", word.form);
        if (*word.unit)
            kmp_text_printf(text, " (%s)", word.unit);
        if (*word.meaning)
            kmp_text_printf(text, ": %s", word.meaning);
    }
}

void kmp_answer_hover(kempe_language_server *s, kmp_open_file *file, size_t offset, kmp_reply *answer)
{
    const char *whole = file->text;
    size_t begin = offset, end = offset;
    while (begin > 0 && (kmp_parse_word_length(whole + begin - 1) > 0 || strchr("0123456789", whole[begin - 1])))
        begin--;
    while (whole[end] && (kmp_parse_word_length(whole + end) > 0 || strchr("0123456789", whole[end])))
        end++;
    if (!file->is_good || begin == end)
        return;
    kmp_text text = {0};
    kmp_model_names names;
    kmp_names_find(&names, s->schema, &file->good, kmp_session_beside, s);
    const kmp_name_use *use = kmp_names_at(&names, offset);
    const kmp_found_node found = kmp_node_at(s->schema, file->good.root, file->good.text, offset);
    const char *word = kmp_arena_printf(&s->work, "%.*s", (int)(end - begin), whole + begin);
    if (use)
        describe_name(file, &names.declared[use->declared], &text);
    else if (found.node && found.is_key)
        describe_key(&found, &text);
    else if (found.node && word && kmp_schema_is(&found.schemas, "output_name"))
        describe_word(word, true, &text);
    else if (found.node && word && kmp_schema_is(&found.schemas, "number"))
        describe_word(word, false, &text);
    if (text.length == 0 && found.node && !found.is_key && found.schemas.count > 0 && *found.schemas.one[0].meaning)
        kmp_text_printf(&text, "**%s**: %s", found.key, found.schemas.one[0].meaning);
    if (text.length > 0) {
        kmp_json_put(&answer->json, "{ contents { kind %s value %s }", "markdown", text.s);
        kmp_put_range(s, &answer->json, "range", whole, use ? use->begin : begin, use ? use->end : end);
        kmp_json_end(&answer->json);
    }
    kmp_text_free(&text);
    kmp_names_free(&names);
}
