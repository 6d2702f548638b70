/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: exchange */
/* Ranges of joints of URDF, MJCF and SDFormat as stops in a run: masses on vertical slides fall freely until a range
 * ends, at sqrt(2 h/g), and rest there with the force m g. */
#include "foreign_models.h"
#include "testing.h"
#include <kempe/table.h>
#include <math.h>

#define G 9.81

static const struct {
    const char *name, *text;
    double start; /* of the coordinate 'down' */
} cases[] = {
    {"r.urdf",
     "<robot name='r'><link name='base'/>"
     "<link name='a'><inertial><mass value='2'/></inertial></link><link name='b'><inertial><mass "
     "value='3'/></inertial></link>"
     "<joint name='down' type='prismatic'><parent link='base'/><child link='a'/><axis xyz='0 0 1'/>"
     "<limit lower='-0.5' upper='0.1'/></joint>"
     "<joint name='turned' type='prismatic'><parent link='base'/><child link='b'/><axis xyz='0 0 -1'/>"
     "<limit lower='-0.1' upper='0.8'/></joint></robot>",
     0.0},
    {"r.mjcf",
     "<mujoco><worldbody>"
     "<body name='a'><joint name='down' type='slide' axis='0 0 1' limited='true' range='-0.2 0.4' ref='0.3'/>"
     "<inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/></body>"
     "<body name='b'><joint name='turned' type='slide' axis='0 0 -1' limited='true' range='-0.1 0.8'/>"
     "<inertial pos='0 0 0' mass='3' diaginertia='1 1 1'/></body></worldbody></mujoco>",
     0.3},
    {"r.sdf",
     "<sdf version='1.9'><world name='w'><gravity>0 0 -9.81</gravity><model name='m'>"
     "<link name='a'><inertial><mass>2</mass></inertial></link><link "
     "name='b'><inertial><mass>3</mass></inertial></link>"
     "<joint name='down' type='prismatic'><parent>world</parent><child>a</child><axis><xyz>0 0 1</xyz>"
     "<limit><lower>-0.5</lower><upper>0.1</upper></limit></axis></joint>"
     "<joint name='turned' type='prismatic'><parent>world</parent><child>b</child><axis><xyz>0 0 -1</xyz>"
     "<limit><lower>-0.1</lower><upper>0.8</upper></limit></axis></joint></model></world></sdf>",
     0.0},
};

static kempe_context *context;

/* The first entry of the log at this time. */
static bool has_entry(const kempe_table *log, double t)
{
    bool found = false;
    for (int row = 0; row < kempe_table_row_count(log); row++)
        found = found || fabs(kempe_table_number(log, row, kempe_table_find(log, "t")) - t) < 1e-9;
    return found;
}

static bool ends_with(const char *name, const char *part)
{
    return strlen(name) >= strlen(part) && strcmp(name + strlen(name) - strlen(part), part) == 0;
}

/* Falls of 0.5 m and 0.8 m; the second mass rests at the upper end of a range that points down. */
static void check_run(const kempe_system *system, double start)
{
    static const double weight[2] = {2 * G, 3 * G};
    kempe_trajectory *run = NULL;
    kempe_table *log = NULL;
    CHECK(kempe_simulate(system, &(kempe_run_options){.t_end = 1, .rtol = 1e-10, .output_step = 0.05}, &run) ==
          KEMPE_OK);
    CHECK(run && kempe_trajectory_table(run, "log", &log) == KEMPE_OK);
    CHECK(log && has_entry(log, sqrt(2 * 0.5 / G)) && has_entry(log, sqrt(2 * 0.8 / G)));
    for (int k = 0; run && k < kempe_trajectory_row_count(run); k++) {
        double t = kempe_trajectory_time(run, k), fall = G * t * t / 2;
        const double *q = kempe_trajectory_q(run, k), *qd = kempe_trajectory_qd(run, k);
        CHECK(fabs(q[0] - (start - fmin(fall, 0.5))) < 1e-9 && fabs(q[1] - fmin(fall, 0.8)) < 1e-9);
        CHECK(fabs(qd[0] + (fall < 0.5 ? G * t : 0)) < 1e-9 && fabs(qd[1] - (fall < 0.8 ? G * t : 0)) < 1e-9);
    }
    const double *lambda = run ? kempe_trajectory_lambda(run, kempe_trajectory_row_count(run) - 1) : NULL;
    for (int k = 0; lambda && k < kempe_system_row_count(system); k++) {
        const char *name = kempe_system_row_name(system, k);
        double wanted = ends_with(name, "down_lower.1") ? weight[0] : ends_with(name, "turned_upper.1") ? weight[1] : 0;
        CHECK(fabs(lambda[k] - wanted) < 1e-9);
    }
    kempe_table_free(log);
    kempe_trajectory_free(run);
}

static void falls_onto_stops(void)
{
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
        for (int asked = 0; asked < 2; asked++) {
            kempe_model *model = NULL;
            kempe_system *system = NULL;
            kempe_context_set_joint_limits(context, asked);
            CHECK(kempe_model_read_text(context, cases[k].text, cases[k].name, &model) == KEMPE_OK);
            CHECK(model && kempe_system_new(model, &system) == KEMPE_OK);
            if (system && asked)
                check_run(system, cases[k].start);
            else
                CHECK(system && kempe_system_row_count(system) == 0);
            kempe_system_free(system);
            kempe_model_free(model);
        }
}

int main(void)
{
    context = kempe_context_new();
    TEST(falls_onto_stops);
    kempe_context_free(context);
    return check_report();
}
