/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail exchange */
/* Every file of tests/malformed is refused with the complaints that its first lines announce
 * (`# expect: LINE:COLUMN: part of the sentence`, in XML a comment) and with no others. */
#include "base/file.h"
#include "base/memory.h"
#include "testing.h"
#include <dirent.h>
#include <kempe/kempe.h>
#include <stdlib.h>

#define FOLDER KEMPE_ROOT "/tests/malformed"
static const char mark[] = "# expect: ", xml_mark[] = "<!-- expect: ", xml_end[] = " -->";

static kempe_context *context;

static int count_lines(const char *s)
{
    int n = *s != '\0';
    for (; *s; s++)
        n += *s == '\n';
    return n;
}

/* The line of `message` that begins with path:place and contains the rest of the expectation. */
static bool is_said(const char *message, const char *path, const char *expected)
{
    size_t path_length = strlen(path);
    size_t place_length = strcspn(expected, " ");
    const char *part = expected + place_length + 1;
    for (const char *line = message; line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : NULL) {
        if (strncmp(line, path, path_length) != 0 || line[path_length] != ':' ||
            strncmp(line + path_length + 1, expected, place_length) != 0)
            continue;
        const char *found = strstr(line, part), *end = strchr(line, '\n');
        if (found && (!end || found < end))
            return true;
    }
    return false;
}

/* The expectation that a line holds, cut out of it; NULL when it holds none. */
static char *expectation(char *line)
{
    size_t length = strlen(line), tail = sizeof xml_end - 1;
    if (strncmp(line, mark, sizeof mark - 1) == 0)
        return line + sizeof mark - 1;
    if (strncmp(line, xml_mark, sizeof xml_mark - 1) != 0 || strcmp(line + length - tail, xml_end) != 0)
        return NULL;
    line[length - tail] = '\0';
    return line + sizeof xml_mark - 1;
}

static void check_expectations(char *text, const char *path, const char *message)
{
    int expected = 0;
    bool good = true;
    for (bool last = false; !last;) {
        char *end = text + strcspn(text, "\n");
        last = *end == '\0';
        *end = '\0';
        const char *sentence = expectation(text);
        if (!sentence)
            break;
        expected++;
        if (!is_said(message, path, sentence)) {
            printf("%s: not said: %s\n", path, sentence);
            good = false;
        }
        text = end + 1;
    }
    CHECK(expected > 0);
    CHECK(expected == count_lines(message));
    if (!good || expected != count_lines(message))
        printf("it said:\n%s\n", message);
    CHECK(good);
}

static void check_file(const char *path)
{
    char *text = NULL;
    size_t length;
    kempe_model *model = NULL;
    CHECK(kmp_file_read(context, KMP_FILE_MODEL, path, &text, &length) == KEMPE_OK);
    CHECK(kempe_model_read(context, path, &model) == KEMPE_E_INPUT);
    CHECK(model == NULL);
    if (text)
        check_expectations(text, path, kempe_context_message(context));
    kmp_free(text);
    kempe_model_free(model);
}

static void every_file(void)
{
    int count = 0;
    DIR *folder = opendir(FOLDER);
    CHECK(folder != NULL);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        char path[1024];
        if (!strstr(entry->d_name, ".yaml") && !strstr(entry->d_name, ".mbs"))
            continue;
        snprintf(path, sizeof path, "%s/%s", FOLDER, entry->d_name);
        check_file(path);
        count++;
    }
    if (folder)
        closedir(folder);
    CHECK(count >= 112);
}

static void complaints_are_sorted(void)
{
    static const char text[] =
        "kempe: 1\nrun: {t_end: -1}\nbodies:\n  a: {joint: {revolute: w, at: ground}, mass: -1}\n";
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "text", &model) == KEMPE_E_INPUT);
    const char *message = kempe_context_message(context);
    const char *first = strstr(message, "text:2:14:"), *second = strstr(message, "text:4:25:"),
               *third = strstr(message, "text:4:47:");
    CHECK(first == message && second > first && third > second);
    CHECK(count_lines(message) == 3);
}

static void missing_file(void)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read(context, FOLDER "/no_such_file.yaml", &model) == KEMPE_E_IO);
    CHECK(strstr(kempe_context_message(context), "no_such_file.yaml") != NULL);
    CHECK(kempe_model_read(context, FOLDER, &model) == KEMPE_E_IO);
    CHECK(model == NULL);
}

static void refuse(const char *text)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "text", &model) == KEMPE_E_INPUT);
    CHECK(kempe_context_message(context)[0] != '\0');
    CHECK(model == NULL);
}

static void deep_brackets(void)
{
    static char text[100001];
    memset(text, '[', sizeof text - 1);
    memcpy(text, "kempe: 1\nbodies: ", 17);
    refuse(text);
    CHECK(strstr(kempe_context_message(context), "nested too deeply") != NULL);
}

/* `before`, then `piece` so many times, then `after`. */
static void refuse_repeated(const char *before, int times, const char *piece, const char *after)
{
    kmp_text text = {0};
    kmp_text_put(&text, before);
    for (int k = 0; k < times; k++)
        kmp_text_put(&text, piece);
    kmp_text_put(&text, after);
    char *s = kmp_text_take(&text);
    CHECK(s != NULL);
    if (s)
        refuse(s);
    kmp_free(s);
}

static const char body[] = "bodies: {a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n";

static void many_anchors(void)
{
    refuse_repeated("kempe: 1\nname: [", 1001, "&a 1, ", "0]\n");
    CHECK(strstr(kempe_context_message(context), "text:2:6008: there are too many anchors") != NULL);
    CHECK(count_lines(kempe_context_message(context)) == 1);
    refuse_repeated("kempe: 1\nname: [", 1000, "&a 1, ", "0]\n");
    CHECK(strstr(kempe_context_message(context), "anchors") == NULL);
}

/* More than are listed are counted. */
static void many_mistakes(void)
{
    refuse_repeated("kempe: 1\n", 300, "x: 1\n", body); /* each is unknown, all but one stand twice */
    const char *message = kempe_context_message(context);
    CHECK(count_lines(message) == 501);
    CHECK(strstr(message, "more errors: the first 500 are listed") != NULL);
    CHECK(strstr(message, ": at least 99 more errors") != NULL);
}

static void odd_texts(void)
{
    refuse("");
    refuse("\n\n");
    refuse("kempe: 1\xff\n");
    refuse("&a [*a, *a]");
    refuse("kempe: 1\nbodies: &b\n  a: *b\n");
    refuse("kempe: 1\nbodies: &b {a: {joint: &j {at: ground, motions: &m [*m, *j, *b]}, inertia: *b, points: *j}}\n");
    refuse("kempe: 1\nname: \"two\\nlines\"\nbodies: {a: {joint: {revolute: \"z\\0z\", at: ground}}}\n");
}

int main(void)
{
    context = kempe_context_new();
    TEST(every_file);
    TEST(complaints_are_sorted);
    TEST(missing_file);
    TEST(odd_texts);
    TEST(deep_brackets);
    TEST(many_anchors);
    TEST(many_mistakes);
    kempe_context_free(context);
    return check_report();
}
