/* SPDX-License-Identifier: BSD-3-Clause */
/* Tables of results: what getters give, text, JSON and CSV, files by their ending, and want of memory at any place. */
#include "base/file.h"
#include "base/memory.h"
#include "output/result_table.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static kempe_context *context;

static kempe_status make(kempe_table **table)
{
    kempe_table *t = kmp_tabulate(context, "runs");
    kmp_tabulate_columns(t, "t[s] reason[words]");
    kmp_tabulate_column(t, "", "q.%s", "crank");
    for (int row = 0; row < 40; row++) {
        kmp_tabulate_row(t);
        kmp_tabulate_cells(t, "%g %s", 0.25 * row, row == 1 ? "a \"lock\", here" : row == 2 ? "ok" : "");
        if (row != 3)
            kmp_tabulate_number(t, row == 4 ? (double)INFINITY : row);
    }
    return kmp_tabulate_finish(context, t, table);
}

static void cells(void)
{
    kempe_table *t = NULL;
    CHECK(make(&t) == KEMPE_OK);
    CHECK_TEXT(kempe_table_name(t), "runs");
    CHECK(kempe_table_row_count(t) == 40 && kempe_table_column_count(t) == 3);
    CHECK(kempe_table_find(t, "q.crank") == 2 && kempe_table_find(t, "q") == -1);
    CHECK_TEXT(kempe_table_unit(t, 0), "s");
    CHECK_TEXT(kempe_table_unit(t, 1), "");
    CHECK(kempe_table_number(t, 39, 0) == 9.75 && kempe_table_values(t, 2)[39] == 39);
    CHECK(isnan(kempe_table_number(t, 3, 2)) && isnan(kempe_table_number(t, 0, 1)));
    CHECK(isnan(kempe_table_number(t, 40, 0)) && isnan(kempe_table_number(t, -1, 0)));
    CHECK(!kempe_table_values(t, 1) && !kempe_table_values(t, 3));
    CHECK_TEXT(kempe_table_word(t, 1, 1), "a \"lock\", here");
    CHECK_TEXT(kempe_table_word(t, 1, 0), "");
    kempe_table_free(t);
}

static char *read_back(const char *path)
{
    char *text = NULL;
    size_t length;
    CHECK(kmp_file_read(context, KMP_FILE_TABLE, path, &text, &length) == KEMPE_OK);
    return text;
}

static void printed(void)
{
    kempe_table *t = NULL;
    char *text = NULL, path[] = "/tmp/kempe_table_XXXXXX.csv";
    CHECK(make(&t) == KEMPE_OK);
    CHECK(kempe_table_print(t, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"name\": \"runs\"") && strstr(text, "\"a \\\"lock\\\", here\""));
    kempe_text_free(text);
    CHECK(kempe_table_print(t, KEMPE_TEXT, &text) == KEMPE_OK);
    CHECK(text && strncmp(text, "            t  reason          ", 31) == 0);
    kempe_text_free(text);
    close(mkstemps(path, 4));
    CHECK(kempe_table_write(t, path) == KEMPE_OK);
    text = read_back(path);
    CHECK(text &&
          strncmp(text, "t,reason,q.crank\n0,,0\n0.25,\"a \"\"lock\"\", here\",1\n0.5,ok,2\n0.75,,\n1,,\n", 68) == 0);
    kmp_free(text);
    unlink(path);
    CHECK(kempe_table_write(t, "/tmp/kempe_table.xls") == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(context), ".npz") != NULL);
    kempe_table_free(t);
}

/* Numbers in the units of their header, in SI; errors have their places. */
static void read_from_csv(void)
{
    static const struct {
        const char *text, *error;
    } wrong[] = {{"t,\n0,1\n", ":1:3: column 2 has no name"},
                 {"t,a\n0,1x\n", ":2:3: this is not a number"},
                 {"t,a\n0\n", ":2:1: 1 field where the header has 2 columns"},
                 {"t,a [yards]\n", ":1:1: column 2: unknown unit 'yards'"},
                 {"# nothing\n", ":2:1: the header line is missing"}};
    char path[] = "/tmp/kempe_table_XXXXXX.csv";
    close(mkstemps(path, 4));
    FILE *file = fopen(path, "w");
    fputs("# a comment\nt,q.crank [deg],x [mm],F [kN]\n0,180,20,\n0.5,-90,1e3,3\n", file);
    fclose(file);
    kempe_table *t = NULL;
    CHECK(kempe_table_read(context, path, &t) == KEMPE_OK);
    CHECK(kempe_table_row_count(t) == 2 && kempe_table_column_count(t) == 4 && kempe_table_find(t, "q.crank") == 1);
    CHECK_NEAR(kempe_table_number(t, 0, 1), 3.14159265358979323846, 1e-16);
    CHECK_NEAR(kempe_table_number(t, 1, 2), 1, 0);
    CHECK_NEAR(kempe_table_number(t, 1, 3), 3000, 0);
    CHECK(isnan(kempe_table_number(t, 0, 3)));
    CHECK(strcmp(kempe_table_unit(t, 2), "m") == 0 && strcmp(kempe_table_unit(t, 3), "N") == 0);
    kempe_table_free(t);
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        file = fopen(path, "w");
        fputs(wrong[k].text, file);
        fclose(file);
        CHECK(kempe_table_read(context, path, &t) == KEMPE_E_INPUT && !t);
        CHECK(strstr(kempe_context_message(context), wrong[k].error) != NULL);
    }
    unlink(path);
    CHECK(kempe_table_read(context, path, &t) == KEMPE_E_IO && !t);
}

/* Columns in rad and its rates are converted, with their units; all others are not. */
static void degrees(void)
{
    static const char *const units[] = {"rad", "rad/s", "rad/s^2", "m", "N m/rad", ""};
    static const char *const shown[] = {"deg", "deg/s", "deg/s^2", "m", "N m/rad", ""};
    const double right = 1.5707963267948966;
    char *text = NULL;
    CHECK(kempe_context_set_angle_unit(context, "grad") == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(context), "rad and deg") != NULL);
    for (int pass = 0; pass < 3; pass++) {
        kempe_table *t = NULL, *made = kmp_tabulate(context, "angles");
        CHECK(kempe_context_set_angle_unit(context, pass == 1 ? "deg" : "rad") == KEMPE_OK);
        for (int k = 0; k < 6; k++)
            kmp_tabulate_column(made, units[k], "x%d", k);
        kmp_tabulate_row(made);
        for (int k = 0; k < 6; k++)
            kmp_tabulate_number(made, right);
        CHECK(kmp_tabulate_finish(context, made, &t) == KEMPE_OK);
        for (int k = 0; k < 6; k++) {
            CHECK_TEXT(kempe_table_unit(t, k), pass == 1 ? shown[k] : units[k]);
            CHECK(kempe_table_number(t, 0, k) == (pass == 1 && k < 3 ? 90 : right));
        }
        CHECK(kempe_table_print(t, KEMPE_JSON, &text) == KEMPE_OK);
        CHECK(text && (strstr(text, "\"deg/s^2\"") != NULL) == (pass == 1));
        kempe_text_free(text);
        kempe_table_free(t);
    }
}

/* NumPy's own reading is tested by tests/cli.py. */
static void zipped(void)
{
    kempe_table *t = NULL;
    char path[] = "/tmp/kempe_table_XXXXXX.npz", *bytes = NULL;
    size_t length = 0;
    CHECK(make(&t) == KEMPE_OK);
    close(mkstemps(path, 4));
    CHECK(kempe_table_write(t, path) == KEMPE_OK);
    CHECK(kmp_file_read(context, KMP_FILE_TABLE, path, &bytes, &length) == KEMPE_OK && length > 40 * 2 * 8);
    kmp_free(bytes);
    unlink(path);
    kempe_table_free(t);
}

static void without_memory(void)
{
    kempe_status status = KEMPE_E_MEMORY;
    for (unsigned long n = 1; status == KEMPE_E_MEMORY && n < 200; n++) {
        kempe_table *t = NULL;
        kmp_memory_fail_at(n);
        status = make(&t);
        kmp_memory_fail_at(0);
        CHECK((status == KEMPE_OK) == (t != NULL));
        kempe_table_free(t);
    }
    CHECK(status == KEMPE_OK);
}

/* A plot for each unit; columns by the names of outputs; names that are wrong. */
static void drawn(void)
{
    char path[] = "/tmp/kempe_table_XXXXXX.svg";
    kempe_table *t = kmp_tabulate(context, "rows"), *made = NULL;
    kmp_tabulate_columns(t, "t[s] position.b.P.x[m] position.b.P.y[m] force.spring[N]");
    for (int k = 0; k < 5; k++) {
        kmp_tabulate_row(t);
        kmp_tabulate_numbers(t, 4, (double[]){k, k * k, -k, 3 - k});
    }
    CHECK(kmp_tabulate_finish(context, t, &made) == KEMPE_OK);
    close(mkstemps(path, 4));
    CHECK(kempe_table_write_picture(made, NULL, "position(b.P), force(spring)", path) == KEMPE_OK);
    char *text = read_back(path);
    int frames = 0, curves = 0;
    for (const char *s = text; s && (s = strstr(s, "class=\"frame\"")); s++)
        frames++;
    for (const char *s = text; s && (s = strstr(s, "<path class=\"curve\"")); s++)
        curves++;
    CHECK(frames == 2 && curves == 6); /* each curve has an entry in the legend */
    CHECK(text && strstr(text, ">position.b.P.y</text>") && strstr(text, "t, s"));
    kmp_free(text);
    CHECK(kempe_table_write_picture(made, "position(b.P).x", "position(b.P).y", path) == KEMPE_OK);
    CHECK(kempe_table_write_picture(made, NULL, "q(A)", path) == KEMPE_E_ARGUMENT);
    CHECK(strstr(kempe_context_message(context), "'q(A)'") && strstr(kempe_context_message(context), "force.spring"));
    CHECK(kempe_table_write_picture(made, "w", NULL, path) == KEMPE_E_ARGUMENT);
    unlink(path);
    kempe_table_free(made);
}

/* The table of a file with one row of names and rows of numbers. */
static kempe_table *table_of(const char *text)
{
    char path[] = "/tmp/kempe_table_XXXXXX.csv";
    kempe_table *read = NULL;
    close(mkstemps(path, 4));
    FILE *file = fopen(path, "w");
    CHECK(file && fputs(text, file) >= 0 && fclose(file) == 0);
    CHECK(kempe_table_read(context, path, &read) == KEMPE_OK);
    unlink(path);
    return read;
}

/* The curve of class `dashed` or `curve` of a picture; "": there is none. */
static const char *curve_in(const char *text, const char *class, char path[256])
{
    char begin[64];
    (void)snprintf(begin, sizeof begin, "<path class=\"%s\"", class);
    const char *s = text ? strstr(text, begin) : NULL;
    s = s ? strstr(s, " d=\"") : NULL;
    (void)snprintf(path, 256, "%.*s", s ? (int)strcspn(s + 4, "\"") : 0, s ? s + 4 : "");
    return path;
}

/* Curves of an earlier table, in another unit, are where the same numbers of the table itself are. */
static void drawn_against_another(void)
{
    char path[] = "/tmp/kempe_table_XXXXXX.svg", dashed[256], curve[256];
    kempe_table *own = table_of("t [s],x [m],w\n0,0,1\n1,2,1\n2,-1,4\n"),
                *other = table_of("w,t [ms],x [mm]\n1,0,0\n1,1000,2000\n4,2000,-1000\n"),
                *wrong = table_of("t [s],x [N]\n0,0\n"), *none = table_of("t [s],y\n0,0\n"),
                *timeless = table_of("x [m]\n0\n"), *empty = table_of("t [s],x [m]\n");
    close(mkstemps(path, 4));
    CHECK(kempe_table_write_picture_against(own, other, NULL, "x", path) == KEMPE_OK);
    char *text = read_back(path);
    CHECK(strcmp(curve_in(text, "dashed", dashed), curve_in(text, "curve", curve)) == 0 && strlen(curve) > 10);
    CHECK(text && strstr(text, kempe_table_name(other))); /* in the legend */
    kmp_free(text);
    CHECK(kempe_table_write_picture_against(own, wrong, "t", "x", path) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "has 'x' in N, this one in m"));
    CHECK(kempe_table_write_picture_against(own, none, NULL, NULL, path) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "none of the columns of the picture"));
    CHECK(kempe_table_write_picture_against(own, timeless, NULL, NULL, path) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(context), "has no column 't'"));
    unlink(path);
    /* Of a run that failed at its start: no column is named that it would have had. */
    CHECK(kempe_table_write_picture(empty, NULL, "q(A)", path) == KEMPE_E_FAILED);
    CHECK(strstr(kempe_context_message(context), "nothing to draw"));
    kempe_table *const tables[] = {own, other, wrong, none, timeless, empty};
    for (int k = 0; k < 6; k++)
        kempe_table_free(tables[k]);
}

/* The points of the first curve of the picture of rows (k, y) with a peak at one of them: their number, and the lowest
 * and highest places. */
static int points_drawn(int rows, int step, int peak, double range[2])
{
    char path[] = "/tmp/kempe_table_XXXXXX.svg";
    kempe_table *t = kmp_tabulate(context, "rows"), *made = NULL;
    kmp_tabulate_columns(t, "t[s] y[m]");
    for (int k = 0; k < rows; k += step) {
        kmp_tabulate_row(t);
        kmp_tabulate_numbers(t, 2, (double[]){k, k == peak ? 5 : k == peak + step ? -3 : sin(1e-3 * k)});
    }
    CHECK(kmp_tabulate_finish(context, t, &made) == KEMPE_OK);
    close(mkstemps(path, 4));
    CHECK(kempe_table_write_picture(made, NULL, "y", path) == KEMPE_OK);
    char *text = read_back(path), *s = text ? strstr(text, "<path class=\"curve\"") : NULL,
         *end = s ? strstr(s, "\"/>") : NULL;
    s = s ? strstr(s, " d=\"M") : NULL;
    int count = 0;
    for (s = s ? s + 4 : NULL; s && s < end; count++) {
        (void)strtod(s + 1, &s);
        double y = strtod(s, &s);
        range[0] = count == 0 ? y : fmin(range[0], y);
        range[1] = count == 0 ? y : fmax(range[1], y);
    }
    kmp_free(text);
    unlink(path);
    kempe_table_free(made);
    return count;
}

/* A picture of many rows has as many points as can be seen, with each peak; one of few rows has all. */
static void many_rows_drawn(void)
{
    double few[2], many[2];
    CHECK(points_drawn(300000, 1000, 123000, few) == 300);
    const int count = points_drawn(300000, 1, 123456, many);
    CHECK(count > 1000 && count < 5000);
    CHECK_NEAR(few[0], many[0], 0.011);
    CHECK_NEAR(few[1], many[1], 0.011);
}

static void names_with_units(void)
{
    char path[] = "/tmp/kempe_table_XXXXXX.csv";
    kempe_table *t = kmp_tabulate(context, "rows");
    kmp_tabulate_columns(t, "t[s] zone moment[N m] word[words]");
    kmp_tabulate_row(t);
    kmp_tabulate_cells(t, "%g %ld %g %s", 2.5, 1L, 0.5, "ok");
    close(mkstemps(path, 4));
    kempe_table_name_units(t);
    CHECK(kempe_table_write(t, path) == KEMPE_OK);
    char *text = read_back(path);
    CHECK_TEXT(text ? text : "", "t [s],zone,moment [N m],word\n2.5,1,0.5,ok\n");
    kmp_free(text);
    unlink(path);
    kempe_table_free(t);
}

int main(void)
{
    context = kempe_context_new();
    TEST(cells);
    TEST(printed);
    TEST(read_from_csv);
    TEST(degrees);
    TEST(zipped);
    TEST(drawn);
    TEST(drawn_against_another);
    TEST(many_rows_drawn);
    TEST(names_with_units);
    TEST(without_memory);
    kempe_context_free(context);
    return check_report();
}
