/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* ctest: not_sanitized */
/* ROBOTRAN's models: M, C, inverse dynamics, h, J and jdqd at a fixed state against the values of the code that
 * ROBOTRAN generates for them. Two of the models stand here in Kempe's own language; the others are read where the
 * folder KEMPE_MBS has them. */
#include "backend/machine.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "dynamics/kinematics/kinematics_numbers.h"
#include "dynamics/kinematics/link_tree.h"
#include "foreign_models.h"
#include "model/data/start.h"
#include "studies/show/sets.h"
#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Quantities that ROBOTRAN writes, too. */
#define ROBOTRAN_SETS                                                                                                  \
    (1u << KMP_EQ_M | 1u << KMP_EQ_C | 1u << KMP_EQ_INVDYN | 1u << KMP_EQ_H | 1u << KMP_EQ_J | 1u << KMP_EQ_JDQD)

enum { MOST = 64 };

static const double tolerance = 1e-9;

/* Trace, Frobenius norm and sum of M; norm and sum of the others, M11 beside. */
typedef struct golden {
    const char *file;
    double trace, norm_m, sum_m, m11, norm_c, sum_c, norm_inverse, sum_inverse;
    int rows;
    double norm_h, sum_h, norm_j, sum_j, norm_jdqd, sum_jdqd;
} golden;

static const golden published[] = {
    {"piston4", 35.22999865724, 34.58161619313, 36.55498672672, 34.563, 339.1235662235, 345.5256714614, 332.3916216419,
     338.7742669518, 2, 0.1916007289453, 0.2007601592362, 1.019999584643, -1.263354181359, 0.001526681249667,
     -0.001620660816033},
    {"suspension5", 315.5425723018, 314.6940084916, 310.3934258685, 314.68, 3087.078345348, -3059.894718533,
     3149.175185482, -3121.527594961, 2, 0.01889516046883, 0.01315132637466, 0.5366863806067, -0.441345515569,
     0.001942157162772, -0.0005029635768208},
    {"bus24", 63777.09787647, 28064.99182805, 66470.99366563, 13482.96, 132849.6509108, 145018.0103113, 130539.6360488,
     145077.7461724, 11, 0.1233651844672, 0.1007176408569, 1.635110270416, -0.2629342945186, 0.004936564955135,
     0.003302803125544},
    {"roadster52", 4892.834838038, 2193.972003874, 4922.366012709, 974, 9587.82514238, 8864.195881865, 9448.952970205,
     8514.384942387, 36, 0.109248159499, 0.002241817424922, 2.767404032075, 0.7244330915195, 0.01016033167363,
     0.007426044870009},
};

enum { MODELS = sizeof published / sizeof *published };

static kempe_context *context;

/* -- values ------------------------------------------------------------------------------------------ */

static void check_value(const char *file, const char *what, double value, double expected)
{
    double error = fabs(value - expected) / fabs(expected);
    if (!(error <= tolerance))
        printf("%s: %s is %.13g, not %.13g\n", file, what, value, expected);
    CHECK(error <= tolerance);
}

static void check_vector(const char *file, const char *what, int count, const double *x, double size, double total)
{
    double sum = 0, squares = 0;
    for (int k = 0; k < count; k++) {
        sum += x[k];
        squares += x[k] * x[k];
    }
    check_value(file, what, sqrt(squares), size);
    check_value(file, what, sum, total);
}

static void check_mass(const golden *g, int n, const double *lower)
{
    double trace = 0, total = 0, squares = 0;
    for (int i = 0, at = 0; i < n; i++)
        for (int k = 0; k <= i; k++, at++) {
            trace += i == k ? lower[at] : 0;
            total += i == k ? lower[at] : 2 * lower[at];
            squares += (i == k ? 1 : 2) * lower[at] * lower[at];
        }
    check_value(g->file, "trace M", trace, g->trace);
    check_value(g->file, "norm M", sqrt(squares), g->norm_m);
    check_value(g->file, "sum M", total, g->sum_m);
    check_value(g->file, "M11", lower[0], g->m11);
}

static void set_state(const kmp_equations *eq, kmp_machine *machine)
{
    static double q[MOST], qd[MOST], qdd[MOST];
    static const double zero[3 * MOST];
    double *symbols = calloc((size_t)kmp_tree_symbol_count(&eq->tree) + 1, sizeof *symbols);
    for (int i = 1; i <= eq->n; i++) {
        q[i - 1] = kmp_model_start(eq->model)->q[i - 1].value + 0.05 * cos(i);
        qd[i - 1] = 0.1 * sin(2 * i);
        qdd[i - 1] = 0.2 * cos(3 * i);
    }
    kmp_tree_symbol_values(&eq->tree, symbols);
    kmp_machine_set(machine, KMP_IN_PARAMETER, symbols);
    kmp_machine_set(machine, KMP_IN_TIME, zero);
    kmp_machine_set(machine, KMP_IN_Q, q);
    kmp_machine_set(machine, KMP_IN_QD, qd);
    kmp_machine_set(machine, KMP_IN_QDD, qdd);
    kmp_machine_set(machine, KMP_IN_FORCE, zero);
    kmp_machine_set(machine, KMP_IN_TORQUE, zero);
    free(symbols);
}

static void check_equations(const golden *g, const kmp_equations *eq)
{
    const unsigned all = ROBOTRAN_SETS;
    int n = eq->n, m = eq->m;
    kmp_program *program = kmp_sets_program(eq, all);
    kmp_machine *machine = kmp_machine_new(program, kmp_backend_find("tape"));
    set_state(eq, machine);
    (void)kmp_machine_run(machine, 0);
    const double *out = kmp_machine_run(machine, 1);
    CHECK(m == g->rows);
    if (m == g->rows) {
        check_mass(g, n, out);
        out += n * (n + 1) / 2;
        check_vector(g->file, "C", n, out, g->norm_c, g->sum_c);
        check_vector(g->file, "inverse dynamics", n, out + n, g->norm_inverse, g->sum_inverse);
        out += 2 * n;
        check_vector(g->file, "h", m, out, g->norm_h, g->sum_h);
        check_vector(g->file, "J", m * n, out + m, g->norm_j, g->sum_j);
        check_vector(g->file, "jdqd", m, out + m + m * n, g->norm_jdqd, g->sum_jdqd);
    }
    kmp_machine_free(machine);
    kmp_program_free(program);
}

/* By either scheme, with numbers folded and kept. */
static void check_model(const golden *g, const char *path)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
    if (!model) {
        printf("%s\n", kempe_context_message(context));
        return;
    }
    for (int way = 0; way < 4; way++) {
        kmp_derivation_request scene = {.sets = kmp_sets_derive(ROBOTRAN_SETS),
                                        .scheme = way & 1 ? KMP_SCHEME_NER : KMP_SCHEME_COMPOSITE,
                                        .keep = way & 2 ? KMP_KEEP_NUMBERS : KMP_KEEP_NOTHING,
                                        .body_inputs = way & 2,
                                        .loops_alone = true};
        kmp_equations eq;
        CHECK(kmp_equations_derive(&eq, model, &scene) == KEMPE_OK);
        check_equations(g, &eq);
        kmp_equations_free(&eq);
    }
    kempe_model_free(model);
}

/* -- models ------------------------------------------------------------------------------------------ */

static const char *path_in(const char *folder, const char *name, const char *ending)
{
    static char path[1024];
    snprintf(path, sizeof path, "%s/%s%s", folder, name, ending);
    return path;
}

static void values_of_own_models(void)
{
    for (int k = 0; k < 2; k++)
        check_model(&published[k], path_in(KEMPE_ROOT "/tests/models", published[k].file, ".yaml"));
}

static void values_of_robotran_files(void)
{
    const char *folder = getenv("KEMPE_MBS");
    if (!folder) {
        printf("KEMPE_MBS names no folder of .mbs files: their values are not looked at\n");
        return;
    }
    for (int k = 0; k < MODELS; k++)
        check_model(&published[k], path_in(folder, published[k].file, ".mbs"));
}

/* -- the reader -------------------------------------------------------------------------------------- */

static const char own[] = KEMPE_ROOT "/tests/models/robotran.mbs";

/* Parts of robotran.mbs that are not read. */
static const char left_out[] = "colour, weather, extforce, link";

static void same_as_in_own_language(void)
{
    foreign_same(context, own, KEMPE_ROOT "/tests/models/robotran.yaml");
}

static void what_is_not_used(void)
{
    CHECK_TEXT(
        foreign_log(context, NULL, own),
        "2 /tests/models/robotran.mbs:23:9: force point 'wind' is not used: its law is in user code; write a force of "
        "Kempe; the machine differs from the file\n"
        "2 /tests/models/robotran.mbs:75:5: link 'coil' is not used: its law is in user code; write a force of Kempe; "
        "the machine differs from the file\n"
        "2 /tests/models/robotran.mbs:24:7: 'colour' in 'body' is not used; the machine differs from the file\n"
        "2 /tests/models/robotran.mbs:88:3: 'weather' in 'mbsDescR7' is not used; the machine differs from the "
        "file\n"
        "2 /tests/models/robotran.mbs:21:7: the inertia of body '_3rd_cart' is impossible: yy = 0.8 is more than zz + "
        "xx = 0.2; it is used as given\n"
        "2 /tests/models/robotran.mbs:81:7: parameter 'coil_K' is not used\n"
        "2 /tests/models/robotran.mbs:83:7: parameter 'coil_rest_length' is not used\n");
    CHECK(kempe_context_set_left_out(context, NULL) == KEMPE_OK);
    foreign_strict(context, own, 4);
    CHECK(kempe_context_set_left_out(context, left_out) == KEMPE_OK);
}

static void inside_another_model(void)
{
    static const char text[] =
        "kempe: 1\ninclude: [{file: robotran.mbs, prefix: a_, leave_out: [colour, weather, link, extforce]}]\n"
        "forces: {f: {joint: a_hinge, torque: a_coil_K}}\n";
    kempe_model *model = NULL;
    CHECK(kempe_context_set_left_out(context, NULL) == KEMPE_OK);
    CHECK(kempe_model_read_text(context, text, KEMPE_ROOT "/tests/models/outer.yaml", &model) == KEMPE_OK);
    if (!model) {
        printf("%s\n", kempe_context_message(context));
        return;
    }
    CHECK(kempe_model_coordinate_count(model) == 7);
    CHECK_TEXT(kempe_model_coordinate_name(model, 0), "a_slide");
    CHECK_TEXT(kempe_model_coordinate_name(model, 2), "a_hinge");
    kempe_model_free(model);
    CHECK(kempe_context_set_left_out(context, left_out) == KEMPE_OK);
}

/* XML is read as such under any file name; the mark of UTF-8 may stand before. */
static void found_by_its_beginning(void)
{
    static const char text[] = "\xef\xbb\xbf\n<mbsDescR7><bodytree><body><bodyname>a</bodyname><parent><bodyname>base"
                               "</bodyname></parent><joint><type>R1</type></joint></body></bodytree></mbsDescR7>";
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, text, "a/text.xml", &model) == KEMPE_OK);
    if (model) {
        CHECK_TEXT(kempe_model_name(model), "text");
        CHECK_TEXT(kempe_model_coordinate_name(model, 0), "a");
    }
    kempe_model_free(model);
}

static void refuse(const char *text, const char *sentence)
{
    foreign_refuse(context, "x.mbs", text, sentence);
}

static void odd_texts(void)
{
    static char deep[800];
    for (int k = 0; k < 101; k++)
        memcpy(deep + 3 * k, "<a>", 3);
    refuse("", "x.mbs:1:1: XML: no element found");
    refuse("kempe: 1", "x.mbs:1:1: XML: syntax error");
    refuse("<mbsDescR7>\n<base>\n</bse>", "x.mbs:3:3: XML: mismatched tag");
    refuse("<a/>", "x.mbs:1:1: the outermost element is 'a': models begin with 'mbsDescR7' (ROBOTRAN), 'mujoco' "
                   "(MJCF), 'robot' (URDF) or 'sdf' (SDFormat)");
    refuse("<!DOCTYPE a [<!ENTITY b 'c'>]>\n<a>&b;</a>", "x.mbs:1:13: XML: a model cannot have a document type");
    refuse("<mbsDescR7>&lt;\xff</mbsDescR7>", "x.mbs:1:16: XML: not well-formed (invalid token)");
    refuse(deep, "x.mbs:1:301: XML: the elements are nested too deeply");
    char *huge = calloc(1000100, 1);
    if (huge) {
        memset(huge, 'x', 1000050);
        memcpy(huge, "<a b='", 6);
        strcpy(huge + 1000008, "'/>");
        refuse(huge, "x.mbs:1:1: XML: an attribute has more than a million characters");
        strcpy(huge + 1000006, "'/>");
        refuse(huge, "x.mbs:1:1: the outermost element is 'a': models begin with 'mbsDescR7' (ROBOTRAN), 'mujoco' "
                     "(MJCF), 'robot' (URDF) or 'sdf' (SDFormat)");
    }
    free(huge);
}

static void changed_files(void)
{
    foreign_changed(context, "x.mbs", own);
}

/* All of them are read, and their loops can be derived. */
static void every_file_of_robotran(void)
{
    const char *folder = getenv("KEMPE_MBS");
    DIR *files = folder ? opendir(folder) : NULL;
    for (struct dirent *file; files && (file = readdir(files));) {
        kempe_model *model = NULL;
        const char *ending = strrchr(file->d_name, '.');
        const kmp_derivation_request scene = {.sets = kmp_sets_derive(ROBOTRAN_SETS), .keep = KMP_KEEP_NUMBERS};
        kmp_equations eq;
        if (!ending || strcmp(ending, ".mbs") != 0)
            continue;
        CHECK(kempe_model_read(context, path_in(folder, file->d_name, ""), &model) == KEMPE_OK);
        bool derived = model && kmp_equations_derive(&eq, model, &scene) == KEMPE_OK;
        CHECK(derived);
        if (!derived)
            printf("%s\n", kempe_context_message(context));
        else
            kmp_equations_free(&eq);
        kempe_model_free(model);
    }
    if (files)
        closedir(files);
    else
        printf("KEMPE_MBS names no folder of .mbs files: none is read\n");
}

/* Operations of some sets as one program. */
static long operations(const kempe_model *model, const char *const *names, int count, kmp_tangent_method way)
{
    const kmp_derivation_request scene = {.keep = KMP_KEEP_NUMBERS, .loops_alone = true, .tangents = way};
    unsigned sets = 0;
    kmp_tally tally = {.counts.paper = -1};
    for (int k = 0; k < count; k++)
        sets |= kmp_sets_find(names[k], strlen(names[k]));
    CHECK(kmp_tally_sets(model, &scene, sets, &tally) == KEMPE_OK);
    return tally.counts.paper;
}

/* Inverse dynamics with both derivatives in a few times its own operations, and fewer than by differentiation. */
static void tangents_are_short(void)
{
    static const struct {
        const char *file;
        double most, most_closed;
    } bars[] = {{"suspension5", 2.2, 3.2}, {"humanoid29", 7, 7}, {"car44", 7, 8.5}, {"limousine63", 8.5, 10.5}};
    static const char *const names[] = {"invdyn", "invdyn_q", "invdyn_qd"}, *const closed[] = {"R", "R_tangents"};
    const char *folder = getenv("KEMPE_MBS");
    for (size_t k = 0; k < sizeof bars / sizeof *bars; k++) {
        kempe_model *model = NULL;
        const char *path =
            k ? path_in(folder, bars[k].file, ".mbs") : path_in(KEMPE_ROOT "/tests/models", bars[k].file, ".yaml");
        if (k && !folder) {
            printf("skipped: %s.mbs, KEMPE_MBS names no folder\n", bars[k].file);
            continue;
        }
        CHECK(kempe_model_read(context, path, &model) == KEMPE_OK);
        if (!model)
            continue;
        double alone = (double)operations(model, names, 1, KMP_TANGENT_SHORTER);
        long both = operations(model, names, 3, KMP_TANGENT_SHORTER);
        long all = operations(model, closed, 2, KMP_TANGENT_SHORTER);
        printf("   %s: %.0f, with tangents %ld, with lambda and M %ld\n", bars[k].file, alone, both, all);
        CHECK((double)both <= bars[k].most * alone);
        CHECK((double)all <= bars[k].most_closed * alone);
        CHECK(both <= operations(model, names, 3, KMP_TANGENT_FORWARD));
        kempe_model_free(model);
    }
}

int main(void)
{
    context = kempe_context_new();
    CHECK(kempe_context_set_left_out(context, left_out) == KEMPE_OK);
    TEST(same_as_in_own_language);
    TEST(what_is_not_used);
    TEST(inside_another_model);
    TEST(found_by_its_beginning);
    TEST(odd_texts);
    TEST(changed_files);
    TEST(values_of_own_models);
    TEST(values_of_robotran_files);
    TEST(every_file_of_robotran);
    TEST(tangents_are_short);
    kempe_context_free(context);
    return check_report();
}
