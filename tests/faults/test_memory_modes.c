/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies from files, made here: reading them with every allocation failing once. Four masses in a square with
 * one bending mode and the rigid motions of the plane; three masses in standard input data; two bodies on an elastic
 * joint as matrices. */
/* wings: exchange */
#include "base/file.h"
#include "exhaust.h"
#include "output/named_arrays.h"
#include "output/zip_archive.h"

static char path[] = "/tmp/kempe_modes_XXXXXX.npz", text_path[] = "/tmp/kempe_modes_XXXXXX.sid",
            card_path[] = "/tmp/kempe_modes_XXXXXX.pch";

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

static void put_expansion(kmp_text *text, const char *name, int rows, int columns, const char *entries)
{
    kmp_text_printf(text, "%s\norder = 1\nnrow = %d\nncol = %d\nnq = 1\nstructure = 3\n%s\nend %s\n", name, rows,
                    columns, entries, name);
}

/* Masses of 1 kg at x = 0, 1 m and 2 m, which the mode moves along y by 0, 1 and 4; terms of second order along x. */
static kmp_text standard_input_data(void)
{
    kmp_text text = {0};
    kmp_text_put(&text, "three masses\npart\nnew modal\nrefmod\nmass = 3\nnelastq = 1\nend refmod\nframe\n");
    for (int k = 0; k < 2; k++) {
        kmp_text_printf(&text, "new node = %d\n", k + 1);
        put_expansion(&text, "origin", 3, 1, k == 0 ? "" : "m0(1,1) = 2\nm1(2,1,1) = 4");
        put_expansion(&text, "phi", 3, 1, k == 0 ? "" : "m0(2,1) = 4\nm1(1,1,1) = -1");
        put_expansion(&text, "psi", 3, 1, "");
        put_expansion(&text, "AP", 3, 3, "m0(1,1) = 1\nm0(2,2) = 1\nm0(3,3) = 1");
        kmp_text_put(&text, "end node\n");
    }
    kmp_text_put(&text, "end frame\n");
    put_expansion(&text, "mdCM", 3, 1, "m0(1,1) = 3\nm1(2,1,1) = 5");
    put_expansion(&text, "J", 6, 1, "m0(2,1) = 5\nm0(3,1) = 5\nm1(4,1,1) = -9");
    put_expansion(&text, "Ct", 1, 3, "m0(1,2) = 5\nm1(1,1,1) = -1.5");
    put_expansion(&text, "Cr", 1, 3, "m0(1,3) = 9");
    put_expansion(&text, "Me", 1, 1, "m0(1,1) = 17");
    put_expansion(&text, "Oe", 1, 6, "m0(1,4) = 9\nm1(1,1,1) = -17\nm1(1,1,3) = -17");
    put_expansion(&text, "Ke", 1, 1, "m0(1,1) = 100");
    kmp_text_put(&text, "end modal\nend part\n");
    return text;
}

/* Bodies of 2 and 3 kg a metre apart, with inertia: their joint resists all six relative motions. */
static kmp_text matrices(void)
{
    static const double inertia[12] = {2, 2, 2, 0.5, 0.25, 0.75, 3, 3, 3, 1, 2, 1.5};
    static const double joint[6] = {900, 500, 700, 20, 30, 40};
    double gap[6][12] = {{0}};
    kmp_text text = {0};
    for (int i = 0; i < 6; i++) { /* displacement of the second body from where the first one takes it */
        gap[i][i] = -1;
        gap[i][6 + i] = 1;
    }
    gap[1][5] = -1;
    gap[2][4] = 1;
    kmp_text_put(&text, "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nDMIG,KAAX,0,6,2\nDMIG,MAAX,0,6,2\n");
    for (int i = 0; i < 12; i++)
        for (int j = 0; j <= i; j++) {
            double stiffness = 0;
            for (int r = 0; r < 6; r++)
                stiffness += joint[r] * gap[r][i] * gap[r][j];
            kmp_text_printf(&text, "DMIG,KAAX,%d,%d,,%d,%d,%g\n", j / 6 + 1, j % 6 + 1, i / 6 + 1, i % 6 + 1,
                            stiffness);
            if (i == j)
                kmp_text_printf(&text, "DMIG,MAAX,%d,%d,,%d,%d,%g\n", j / 6 + 1, j % 6 + 1, i / 6 + 1, i % 6 + 1,
                                inertia[i]);
        }
    return text;
}

static bool write_text(const char *to, kmp_text text)
{
    kempe_context *context = kempe_context_new();
    const bool good = context && kmp_file_write(context, to, &text) == KEMPE_OK;
    kempe_context_free(context);
    return good;
}

static kempe_status read_with(scene *s, const char *file, const char *keys, const char *points)
{
    kmp_text text = {0};
    kmp_text_printf(&text,
                    "kempe: 1\nbodies:\n  plate:\n    joint: {name: A, revolute: z, at: ground}\n"
                    "    flexible: {file: %s, %s}\n    points: {%s}\n",
                    file, keys, points);
    kempe_model *model = NULL;
    kempe_status status =
        text.failed ? KEMPE_E_MEMORY : kempe_model_read_text(s->context, text.s, "plate.yaml", &model);
    if (text.failed)
        (void)kmp_fail_memory(s->context);
    kmp_text_free(&text);
    return drop_model(status, model);
}

static kempe_status read_body(scene *s)
{
    return read_with(s, path, "interfaces: {A: [0, 1, 2], B: 3}, frame: clamped, damping: {ratio: 0.1}",
                     "P: {interface: B, offset: [0.1, 0, 0]}, Q: {node: 1}");
}

static kempe_status read_standard_input_data(scene *s)
{
    return read_with(s, text_path, "scale: {length: 1}", "P: {interface: \"2\"}");
}

static kempe_status read_matrices(scene *s)
{
    return read_with(s, card_path, "scale: {length: 1}, interfaces: {A: 1, B: 2}, nodes: {1: [0, 0, 0]}",
                     "P: {interface: B}");
}

static void every_allocation_fails(void)
{
    static const named_stage stages[] = {{"read a body of modes", read_body},
                                         {"read standard input data", read_standard_input_data},
                                         {"read matrices", read_matrices}};
    scene s = {.context = kempe_context_new()};
    const int file = mkstemps(path, 4), text = mkstemps(text_path, 4), cards = mkstemps(card_path, 4);
    CHECK(file >= 0 && text >= 0 && cards >= 0 && s.context && write_body());
    CHECK(write_text(text_path, standard_input_data()) && write_text(card_path, matrices()));
    exhaust_all(&s, stages, sizeof stages / sizeof *stages, 1);
    kempe_context_free(s.context);
    close(file);
    close(text);
    close(cards);
    unlink(path);
    unlink(text_path);
    unlink(card_path);
}

int main(void)
{
    TEST(every_allocation_fails);
    return check_report();
}
