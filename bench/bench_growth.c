/* SPDX-License-Identifier: BSD-3-Clause */
/* Cost of generating the equations of large mechanisms: the trees of bench/trees.h. Each row is a process of its
 * own, so that its peak memory (VmHWM) is that of the row, reading included. Times are of one processor.
 *
 *     bench growth [compiler; that of Kempe if absent]
 */
#include "backend/machine.h"
#include "base/memory.h"
#include "bench.h"
#include "bench/trees.h"
#include "dynamics/choose_variants.h"
#include "dynamics/equations.h"
#include "studies/show/sets.h"
#include <dlfcn.h>
#include <kempe/generate.h>
#include <kempe/kempe.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

static const char *compiler = KEMPE_CC;

static void give_up(kempe_context *context, const char *what)
{
    fprintf(stderr, "%s: %s\n", what, kempe_context_message(context));
    exit(1);
}

static double peak_mb(void)
{
    char line[256];
    long kb = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file))
        if (sscanf(line, "VmHWM: %ld", &kb) == 1)
            break;
    if (file)
        fclose(file);
    return (double)kb / 1024;
}

/* A row of a table in a process of its own. */
typedef void row(tree_shape shape, int n, const char *set);

static void print_row(row *make, tree_shape shape, int n, const char *set)
{
    int status = 0;
    fflush(stdout);
    pid_t child = fork();
    if (child == 0) {
        make(shape, n, set);
        fflush(stdout);
        _exit(0);
    }
    if (child < 0 || waitpid(child, &status, 0) != child || status != 0)
        exit(1);
}

typedef struct made {
    kempe_context *context;
    kempe_model *model;
    kmp_equations eq;
    kmp_program *program;
    long nodes;
    double read_s, derive_s, program_s;
} made;

static made make_program(tree_shape shape, int n, const char *set)
{
    made m = {.context = kempe_context_new()};
    char *text = tree_text(shape, n);
    double begin = bench_now();
    if (!text || kempe_model_read_text(m.context, text, "tree", &m.model))
        give_up(m.context, set);
    m.read_s = bench_now() - begin;
    begin = bench_now();
    unsigned sets = kmp_sets_find(set, strlen(set));
    const kmp_derivation_request scene = {.sets = kmp_sets_derive(sets)};
    if (kmp_equations_derive(&m.eq, m.model, &scene))
        give_up(m.context, set);
    m.derive_s = bench_now() - begin;
    m.nodes = kmp_graph_count(m.eq.graph);
    begin = bench_now();
    m.program = kmp_sets_program(&m.eq, sets);
    if (!m.program)
        give_up(m.context, set);
    m.program_s = bench_now() - begin;
    kmp_free(text);
    return m;
}

/* -- generation -------------------------------------------------------------------------------------- */

static void generated(tree_shape shape, int n, const char *set)
{
    made m = make_program(shape, n, set);
    long paper = kmp_program_count(m.program, 0, 1).paper;
    double peak = peak_mb(), sum = m.derive_s + m.program_s;
    printf("  %-6s %5d %4s | %8.3f %8.3f %8.3f %8.3f | %8ld %8ld | %8.1f %8.1f\n", tree_names[shape], n, set, m.read_s,
           m.derive_s, m.program_s, sum, m.nodes, paper, peak, 1024 * peak / n);
}

static void print_generated(void)
{
    static const int sizes[] = {250, 500, 1000, 2000};
    printf("generated, seconds; nodes of the graph as derived, operations of the program; peak memory\n  %-6s %5s %4s "
           "| %8s "
           "%8s %8s %8s | %8s %8s | %8s %8s\n",
           "tree", "N", "set", "read", "derive", "program", "derive+", "nodes", "+ - * /", "MB", "kB a body");
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++)
        for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
            print_row(generated, s, sizes[k], "qdd");
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++)
        print_row(generated, s, 300, "M_C");
    printf("\n");
}

/* -- evaluated and compiled -------------------------------------------------------------------------- */

enum { MOST = 512, ROUNDS = 5 };

typedef void vector_function(double t, const double *q, const double *qd, double *acc);
typedef void matrix_function(double t, const double *q, const double *qd, double *mass, double *bias);

static double children_s(void)
{
    struct rusage u;
    (void)getrusage(RUSAGE_CHILDREN, &u);
    return (double)(u.ru_utime.tv_sec + u.ru_stime.tv_sec) + 1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

static void *compile(const char *folder, const char *name, int level, double *seconds)
{
    char command[1024], library[512];
    double begin = children_s();
    snprintf(library, sizeof library, "%s/o%d.so", folder, level);
    snprintf(command, sizeof command, "%s -std=c99 -O%d -ffp-contract=off -fPIC -shared -o %s %s/%s.c -lm", compiler,
             level, library, folder, name);
    void *handle = system(command) == 0 ? dlopen(library, RTLD_NOW) : NULL;
    *seconds = children_s() - begin;
    if (!handle) {
        fprintf(stderr, "not compiled: %s\n", command);
        exit(1);
    }
    return handle;
}

/* The largest difference from the tape's entries, 0 when all bits are the same. */
static double difference(int n, bool matrix, const double *tape, const double *out)
{
    double off = 0;
    for (int i = 0; i < n; i++) {
        for (int k = 0; matrix && k <= i; k++)
            off = fmax(off, fabs(*tape++ - out[i * n + k]));
    }
    for (int i = 0; i < n; i++)
        off = fmax(off, fabs(tape[i] - out[(matrix ? n * n : 0) + i]));
    return off;
}

/* Calls the function; seconds, the best of some. */
static double call(void *handle, const char *name, bool matrix, int n, const double *q, const double *qd, double *out)
{
    void *symbol = dlsym(handle, name);
    vector_function *vector;
    matrix_function *both;
    double best = INFINITY;
    memcpy(&vector, &symbol, sizeof symbol);
    memcpy(&both, &symbol, sizeof symbol);
    for (int k = 0; symbol && k < ROUNDS; k++) {
        double begin = bench_now();
        if (matrix)
            both(0, q, qd, out, out + n * n);
        else
            vector(0, q, qd, out);
        best = fmin(best, bench_now() - begin);
    }
    return best;
}

static double tape(kmp_machine *machine, const double **values)
{
    double best = INFINITY;
    (void)kmp_machine_run(machine, 0);
    for (int k = 0; k < ROUNDS; k++) {
        double begin = bench_now();
        *values = kmp_machine_run(machine, 1);
        best = fmin(best, bench_now() - begin);
    }
    return best;
}

static double write_code(const made *m, const char *set, const char *folder, size_t *bytes)
{
    const kempe_generate_options generation = {.sets = set};
    kempe_code *code = NULL;
    double begin = bench_now();
    if (kempe_code_new(m->model, &generation, &code) || kempe_code_write(code, folder))
        give_up(m->context, set);
    double seconds = bench_now() - begin;
    *bytes = 0;
    for (int k = 0; k < kempe_code_file_count(code); k++)
        *bytes += strlen(kempe_code_file_text(code, k));
    kempe_code_free(code);
    return seconds;
}

static void compiled(tree_shape shape, int n, const char *set)
{
    char folder[] = "/tmp/kempe-growth-XXXXXX", name[64], function[128], command[128];
    double q[MOST], qd[MOST], *out = KMP_NEW(double, MOST *(MOST + 1)), t = 0, compile_s[2], call_s[2], off = 0;
    const double *values = NULL;
    const bool matrix = strcmp(set, "M_C") == 0;
    size_t bytes;
    made m = make_program(shape, n, set);
    kmp_machine *machine = kmp_machine_new(m.program, kmp_backend_find("tape"));
    if (!mkdtemp(folder) || !machine || !out)
        exit(1);
    for (int k = 0; k < n; k++) {
        q[k] = 0.3 * sin(k + 1.0);
        qd[k] = cos(2 * k + 1.0);
    }
    kmp_machine_set(machine, KMP_IN_TIME, &t);
    kmp_machine_set(machine, KMP_IN_Q, q);
    kmp_machine_set(machine, KMP_IN_QD, qd);
    double tape_s = tape(machine, &values), write_s = write_code(&m, set, folder, &bytes);
    snprintf(name, sizeof name, "%s_%d", tree_names[shape], n);
    snprintf(function, sizeof function, "%s_%s", name, set);
    for (int level = 0; level < 2; level++) {
        void *handle = compile(folder, name, level, &compile_s[level]);
        call_s[level] = call(handle, function, matrix, n, q, qd, out);
        off = fmax(off, difference(n, matrix, values, out));
        dlclose(handle);
    }
    printf("  %-6s %5d %4s | %8ld %8.0f | %8.2f %8.1f | %8.2f %8.0f | %8.2f %8.0f | %g\n", tree_names[shape], n, set,
           kmp_program_count(m.program, 0, 1).paper, 1e6 * tape_s, write_s, (double)bytes / (1 << 20), compile_s[0],
           1e6 * call_s[0], compile_s[1], 1e6 * call_s[1], off);
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0)
        exit(1);
}

static void print_compiled(void)
{
    printf("evaluated by the tape, written as C, compiled: seconds, us a call; the largest difference of the values\n");
    printf(
        "  %-17s | %8s %8s | %8s %8s | %17s | %17s |\n  %-6s %5s %4s | %8s %8s | %8s %8s | %8s %8s | %8s %8s | off\n",
        "", "", "tape", "C", "", "-O0      ", "-O1      ", "tree", "N", "set", "+ - * /", "us", "write s", "MB",
        "compile", "us", "compile", "us");
    for (tree_shape s = TREE_LINEAR; s < TREE_SHAPES; s++) {
        print_row(compiled, s, 300, "qdd");
        print_row(compiled, s, 300, "M_C");
    }
    printf("\n");
}

/* -- a vehicle --------------------------------------------------------------------------------------- */

enum { TIMES = 25 };

static void vehicle(const char *folder)
{
    static const char sets[] = "M_C+invdyn+h_J+jdqd";
    static const unsigned wanted =
        1u << KMP_EQ_M | 1u << KMP_EQ_C | 1u << KMP_EQ_INVDYN | 1u << KMP_EQ_H | 1u << KMP_EQ_J | 1u << KMP_EQ_JDQD;
    char path[1024];
    made m = {.context = kempe_context_new()};
    double derive_s = INFINITY, sum_s = INFINITY;
    long paper = 0;
    snprintf(path, sizeof path, "%s/limousine63.mbs", folder);
    if (kempe_model_read(m.context, path, &m.model))
        give_up(m.context, path);
    for (int k = 0; k < TIMES; k++) {
        const kmp_derivation_request scene = {.sets = kmp_sets_derive(wanted), .loops_alone = true};
        double begin = bench_now();
        if (kmp_equations_derive(&m.eq, m.model, &scene))
            give_up(m.context, sets);
        derive_s = fmin(derive_s, bench_now() - begin);
        kmp_program *program = kmp_sets_program(&m.eq, wanted);
        sum_s = fmin(sum_s, bench_now() - begin);
        paper = program ? kmp_program_count(program, 0, 1).paper : 0;
        kmp_program_free(program);
        kmp_equations_free(&m.eq);
    }
    printf(
        "limousine63, %s as one program of %ld operations: derived in %.1f ms, and written as a program %.1f ms (the "
        "shortest of %d)\n",
        sets, paper, 1e3 * derive_s, 1e3 * sum_s, TIMES);
    kempe_model_free(m.model);
    kempe_context_free(m.context);
}

int bench_growth(int argc, char **argv)
{
    const char *folder = getenv("KEMPE_MBS");
    if (argc > 1)
        compiler = argv[1];
    print_generated();
    print_compiled();
    if (folder)
        vehicle(folder);
    else
        printf("KEMPE_MBS names no folder of .mbs files: limousine63 is left out\n");
    return 0;
}
