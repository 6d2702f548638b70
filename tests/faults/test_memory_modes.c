/* SPDX-License-Identifier: BSD-3-Clause */
/* A flexible body from a file, made here: reading it with every allocation failing once. Four masses in a square with
 * one bending mode and the rigid motions of the plane. */
#include "base/file.h"
#include "exhaust.h"
#include "output/named_arrays.h"
#include "output/zip_archive.h"

static char path[] = "/tmp/kempe_modes_XXXXXX";

/* An array of NumPy, version 1; the type and the shape as Python writes them. */
static void put(kmp_zip *zip, const char *name, const char *type, const char *shape, int count, const double *values,
                const char *word)
{
    kmp_zip_begin(zip, name);
    kmp_text_append(&zip->text, "\x93NUMPY\x01\x00", 8);
    kmp_text header = {0};
    kmp_text_printf(&header, "{'descr': '%s', 'fortran_order': False, 'shape': %s, }\n", type, shape);
    kmp_put_integer(&zip->text, header.length, 2);
    kmp_text_append(&zip->text, header.s, header.length);
    kmp_text_free(&header);
    for (int k = 0; k < count && values; k++) {
        char bytes[8];
        kmp_put_double(bytes, values[k]);
        kmp_text_append(&zip->text, bytes, 8);
    }
    if (word)
        kmp_text_put(&zip->text, word);
    kmp_zip_end_member(zip);
}

static bool write_body(void)
{
    static const double nodes[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    static const double row[4] = {0, 1, 2, 3}, mass[4] = {1, 1, 1, 1};
    double modes[4][3][4] = {{{0}}}, stiffness[16] = {0};
    for (int i = 0; i < 4; i++) { /* along x, along y, about z, and a shear */
        modes[i][0][0] = modes[i][1][1] = 1;
        modes[i][0][2] = -nodes[3 * i + 1];
        modes[i][1][2] = nodes[3 * i];
        modes[i][2][3] = nodes[3 * i] * nodes[3 * i + 1];
    }
    stiffness[15] = 100;
    kmp_zip zip = {0};
    put(&zip, "format.npy", "|S16", "()", 0, NULL, "kempe-flexible-1");
    put(&zip, "units.npy", "|S6", "()", 0, NULL, "m kg s");
    put(&zip, "K.npy", "<f8", "(4, 4)", 16, stiffness, NULL);
    put(&zip, "nodes.npy", "<f8", "(4, 3)", 12, nodes, NULL);
    put(&zip, "modes.npy", "<f8", "(4, 3, 4)", 48, &modes[0][0][0], NULL);
    put(&zip, "mass_row.npy", "<f8", "(4,)", 4, row, NULL);
    put(&zip, "mass_col.npy", "<f8", "(4,)", 4, row, NULL);
    put(&zip, "mass_value.npy", "<f8", "(4,)", 4, mass, NULL);
    kmp_text text = kmp_zip_end(&zip);
    kempe_context *context = kempe_context_new();
    const bool good = context && kmp_file_write(context, path, &text) == KEMPE_OK;
    kempe_context_free(context);
    return good;
}

static kempe_status read_body(scene *s)
{
    kmp_text text = {0};
    kmp_text_printf(
        &text,
        "kempe: 1\n"
        "bodies:\n"
        "  plate:\n"
        "    joint: {name: A, revolute: z, at: ground}\n"
        "    flexible: {file: %s, interfaces: {A: [0, 1, 2], B: 3}, frame: clamped, damping: {ratio: 0.1}}\n"
        "    mass: 4\n"
        "    points: {P: {interface: B, offset: [0.1, 0, 0]}, Q: {node: 1}}\n",
        path);
    kempe_model *model = NULL;
    kempe_status status =
        text.failed ? KEMPE_E_MEMORY : kempe_model_read_text(s->context, text.s, "plate.yaml", &model);
    if (text.failed)
        (void)kmp_fail_memory(s->context);
    kmp_text_free(&text);
    return drop_model(status, model);
}

static void every_allocation_fails(void)
{
    static const named_stage stages[] = {{"read a body of modes", read_body}};
    scene s = {.context = kempe_context_new()};
    int file = mkstemp(path);
    CHECK(file >= 0 && s.context && write_body());
    exhaust_all(&s, stages, sizeof stages / sizeof *stages, 1);
    kempe_context_free(s.context);
    close(file);
    unlink(path);
}

int main(void)
{
    TEST(every_allocation_fails);
    return check_report();
}
