/* SPDX-License-Identifier: BSD-3-Clause */
/* Layout of a file: blanks at the ends of lines, empty lines, the indentation of blocks. Comments stay. A text whose
 * document is not the same as before is not taken. */
#include "language_server/session.h"
#include <string.h>

enum { STEP = 2, MOST_BLOCKS = 256 };

/* Indentations of the blocks around a line, before and now. */
typedef struct blocks {
    int before[MOST_BLOCKS], now[MOST_BLOCKS], count;
} blocks;

/* The indentation that a block of `before` blanks has now. */
static int indentation(blocks *b, int before)
{
    while (b->count > 1 && b->before[b->count - 1] > before)
        b->count--;
    const int last = b->count - 1;
    if (b->before[last] == before || b->count == MOST_BLOCKS)
        return b->now[last];
    b->before[b->count] = before;
    b->now[b->count] = b->now[last] + STEP;
    return b->now[b->count++];
}

static size_t line_length(const char *line)
{
    return strcspn(line, "\n");
}

static size_t trimmed(const char *line, size_t length)
{
    while (length > 0 && strchr(" \t\r", line[length - 1]))
        length--;
    return length;
}

/* Takes the brackets and quotes of a line, which may span lines; a comment ends it. */
static void take_line(const char *line, size_t length, int *depth, char *quote)
{
    for (size_t k = 0; k < length; k++) {
        const char c = line[k];
        if (*quote)
            *quote = c == *quote ? '\0' : *quote;
        else if (c == '"' || (c == '\'' && (k == 0 || strchr(" [{,:", line[k - 1]))))
            *quote = c;
        else if (c == '#' && (k == 0 || line[k - 1] == ' '))
            break;
        else
            *depth += (c == '[' || c == '{') - (c == ']' || c == '}');
    }
    *depth = *depth < 0 ? 0 : *depth;
}

/* The blanks of the next line that is not empty and no comment; -1: there is none. */
static int blanks_of_next(const char *line)
{
    while (*line) {
        const size_t length = line_length(line), blanks = strspn(line, " ");
        if (trimmed(line, length) > blanks && line[blanks] != '#')
            return (int)blanks;
        line += length + (line[length] == '\n');
    }
    return -1;
}

/* The line with its indentation, and blocks that begin behind `- `. */
static void put_line(kmp_text *to, blocks *b, const char *line, size_t length, int now)
{
    size_t at = strspn(line, " ");
    kmp_text_printf(to, "%*s", now, "");
    while (at + 1 < length && line[at] == '-' && line[at + 1] == ' ' && b->count < MOST_BLOCKS) {
        const size_t content = at + 1 + strspn(line + at + 1, " ");
        kmp_text_put(to, "- ");
        now += STEP;
        b->before[b->count] = (int)content;
        b->now[b->count++] = now;
        at = content;
    }
    kmp_text_append(to, line + at, length - at);
}

/* With `even` the indentation of blocks is two blanks each; otherwise only ends of lines and empty lines change. */
static const char *laid_out(kmp_arena *arena, const char *text, bool even)
{
    kmp_text to = {0};
    blocks b = {.count = 1};
    int depth = 0, shift = 0, empty = 0;
    char quote = '\0';
    for (const char *line = text; *line;) {
        const size_t whole = line_length(line), length = trimmed(line, whole), blanks = strspn(line, " ");
        if (length <= blanks) {
            empty++;
        } else {
            if (empty > 0 && to.length > 0)
                kmp_text_put(&to, "\n");
            empty = 0;
            const bool inside = depth > 0 || quote, comment = line[blanks] == '#' && !quote;
            const int next = comment && !inside ? blanks_of_next(line) : (int)blanks;
            int now = (int)blanks;
            if (even && inside)
                now += shift;
            else if (even && next >= 0)
                now += indentation(&b, next) - next;
            now = now < 0 ? 0 : now;
            if (even && !inside && !comment) {
                shift = now - (int)blanks;
                put_line(&to, &b, line, length, now);
            } else {
                kmp_text_printf(&to, "%*s", now, "");
                kmp_text_append(&to, line + blanks, length - blanks);
            }
            kmp_text_put(&to, "\n");
            if (!comment)
                take_line(line, length, &depth, &quote);
        }
        line += whole + (line[whole] == '\n');
    }
    return kmp_text_keep(&to, arena);
}

enum { MOST_LEVELS = 100, MOST_NODES = 2000000 };

/* True if two nodes have the same content. An alias may be met many times: beyond the bounds they count as different.
 */
static bool is_same_node(const kmp_yaml *a, const kmp_yaml *b, int level, int *nodes)
{
    bool same = a->kind == b->kind && a->count == b->count && a->empty == b->empty && strcmp(a->text, b->text) == 0 &&
                level < MOST_LEVELS && ++*nodes < MOST_NODES;
    for (int k = 0; same && k < a->count; k++)
        same = (a->kind != KMP_YAML_MAP || strcmp(a->keys[k]->text, b->keys[k]->text) == 0) &&
               is_same_node(a->items[k], b->items[k], level + 1, nodes);
    return same;
}

/* The text with another layout; NULL: it would be another document, or there is no memory. */
static const char *checked_layout(kempe_language_server *s, const kmp_open_file *file, bool even)
{
    const char *text = laid_out(&s->work, file->text, even);
    const kmp_yaml *root = text ? kmp_session_parse(s, &s->work, text) : NULL;
    int nodes = 0;
    return root && is_same_node(root, file->good.root, 0, &nodes) ? text : NULL;
}

void kmp_answer_formatting(kempe_language_server *s, kmp_open_file *file, kmp_reply *answer)
{
    const char *text = file->is_good ? checked_layout(s, file, true) : NULL;
    if (!text && file->is_good)
        text = checked_layout(s, file, false);
    kmp_json_array(&answer->json, NULL);
    if (text && strcmp(text, file->text) != 0) {
        kmp_json_object(&answer->json, NULL);
        kmp_put_range(s, &answer->json, "range", file->text, 0, strlen(file->text));
        kmp_json_string(&answer->json, "newText", text);
        kmp_json_end(&answer->json);
    }
    kmp_json_end(&answer->json);
}
