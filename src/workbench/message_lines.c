/* SPDX-License-Identifier: BSD-3-Clause */
#include "workbench/message_lines.h"
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* The place of "FILE:LINE:COLUMN: " or "FILE:LINE: " before a sentence, whose beginning it returns; NULL: there is
 * none. The name may have spaces; the colon of a sentence has no digit right behind it. */
static const char *read_place(const char *line, int *name, long *row, long *column)
{
    const size_t length = strcspn(line, ":\t");
    char *end;
    if (length == 0 || line[length] != ':' || line[length + 1] < '1' || line[length + 1] > '9')
        return NULL;
    *name = (int)length;
    *column = 0;
    *row = strtol(line + length + 1, &end, 10);
    if (*end != ':')
        return NULL;
    if (end[1] != ' ') {
        const char *digits = end + 1;
        *column = strtol(digits, &end, 10);
        if (end == digits || *column < 1 || *end != ':')
            return NULL;
    }
    return end[1] == ' ' ? end + 2 : NULL;
}

static void put_message(kmp_json *json, const char *line, const char *folder)
{
    static const char mark[] = "kempe: ", warning[] = "warning: ";
    line += strncmp(line, mark, strlen(mark)) == 0 ? strlen(mark) : 0;
    const bool warns = strncmp(line, warning, strlen(warning)) == 0;
    int name;
    long row, column;
    line += warns ? strlen(warning) : 0;
    line += strncmp(line, folder, strlen(folder)) == 0 ? strlen(folder) : 0;
    const char *sentence = read_place(line, &name, &row, &column);
    kmp_json_object(json, NULL);
    kmp_json_string(json, "level", warns ? "warning" : "error");
    kmp_json_string(json, "text", sentence ? sentence : line);
    if (sentence) {
        kmp_text file = {0};
        kmp_text_append(&file, line, (size_t)name);
        kmp_json_text(json, "file", &file);
        kmp_json_whole(json, "line", row);
    }
    if (sentence && column > 0)
        kmp_json_whole(json, "column", column);
    kmp_json_end(json);
}

void kmp_put_messages(kmp_json *json, const char *lines, const char *folder)
{
    kmp_json_array(json, "messages");
    for (const char *line = lines; *line;) {
        kmp_text one = {0};
        const size_t length = strcspn(line, "\n");
        kmp_text_append(&one, line, length);
        if (one.s && one.s[strspn(one.s, " \t\r")])
            put_message(json, one.s, folder);
        kmp_text_free_part(json->text, &one);
        line += length + (line[length] == '\n');
    }
    kmp_json_end(json);
}
