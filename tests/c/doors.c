/* What the C library refuses, and what it tells then: states of other scenes, calls out of their time, work without end.
 * Argument: a file, beside which it makes others. */
#define _GNU_SOURCE
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "cutis.h"

static int failures = 0;

#define CHECK(condition)                                                      \
    do {                                                                      \
        if (!(condition)) {                                                   \
            printf("doors.c:%d: %s\n", __LINE__, #condition);                 \
            ++failures;                                                       \
        }                                                                     \
    } while (0)

static CutisSim *scene(const char *E, const char *more) {
    char text[2000], why[500] = "";
    snprintf(text, sizeof text,
             "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [6, 4, 2]\n[[tissue]]\nE = %s\nnu = 0.45\n"
             "[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n%s",
             E, more);
    CutisSim *sim = cutis_sim_new_from_text(text, NULL, why, sizeof why);
    if (sim == NULL) printf("%s\n", why);
    return sim;
}

static int says(const CutisSim *sim, const char *part) {
    char message[1000] = "";
    cutis_sim_message(sim, message, sizeof message);
    int found = strstr(message, part) != NULL;
    if (!found) printf("`%s` is not in: %s\n", part, message);
    return found;
}

static CutisStatus set(CutisSim *sim, const char *name, const double *values) {
    size_t port = cutis_port_find(sim, name);
    return cutis_sim_set_f64(sim, port, values, cutis_port_len(sim, port));
}

static void states_of_other_scenes(void) {
    CutisSim *a = scene("15e3", ""), *b = scene("90e3", ""), *same = scene("15000", "# a comment\n[run]\nend = 7.0\n");
    const double d[6] = {0, 0, 0, 0.003, 0, 0};
    CHECK(cutis_sim_initialise(a) == CUTIS_OK && set(a, "bone.translation", d) == CUTIS_OK && cutis_sim_step(a, 0.1) == CUTIS_OK);
    CutisState *of_a = cutis_sim_save(a), *read = NULL;
    CHECK(cutis_sim_restore(b, of_a) == CUTIS_STATE && says(b, "belongs to model"));
    CHECK(cutis_sim_time(b) == 0.0 && cutis_state_size(b, of_a) == 0);
    size_t n = cutis_state_size(a, of_a);
    unsigned char *bytes = malloc(n);
    CHECK(n > 0 && cutis_state_serialize(b, of_a, bytes, n) == CUTIS_STATE);
    CHECK(cutis_state_serialize(a, of_a, bytes, n) == CUTIS_OK);
    CHECK(cutis_state_deserialize(b, bytes, n, &read) == CUTIS_STATE && read == NULL);
    /* Another way to write the same scene is the same scene. */
    CHECK(cutis_sim_restore(same, of_a) == CUTIS_OK && cutis_sim_time(same) == 0.1);
    CHECK(cutis_state_deserialize(same, bytes, n, &read) == CUTIS_OK);
    cutis_state_free(read), cutis_state_free(of_a), free(bytes);
    cutis_sim_free(a), cutis_sim_free(b), cutis_sim_free(same);
}

static void calls_out_of_their_time(void) {
    CutisSim *sim = scene("15e3", "[gravity]\n"), *fresh = scene("15e3", "[gravity]\n");
    const double pivot[6] = {0, 0, 0, 0.05, 0.02, 0.01}, nowhere[6] = {0, 0, 0, NAN, 0, 0}, held[6] = {0.001, 0, 0, 0, 0, 0};
    const double far[6] = {0, 0, 0, 1e9, 0, 0}, down[3] = {0, -9.81, 0};
    CHECK(cutis_sim_set_time(sim, 3.0) == CUTIS_OK && set(sim, "bone.pivot", pivot) == CUTIS_OK);
    CHECK(set(sim, "bone.translation", held) == CUTIS_ARGUMENT && says(sim, "skull"));
    CHECK(set(sim, "bone.translation", nowhere) == CUTIS_ARGUMENT && set(sim, "bone.translation", far) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_initialise(sim) == CUTIS_OK && cutis_sim_time(sim) == 3.0);
    CHECK(set(sim, "bone.pivot", pivot) == CUTIS_ARGUMENT && says(sim, "before cutis_sim_initialise"));
    CHECK(cutis_sim_set_time(sim, 4.0) == CUTIS_ARGUMENT && cutis_sim_time(sim) == 3.0);
    CHECK(cutis_port_causality(sim, cutis_port_find(sim, "gravity")) == CUTIS_TUNABLE_PARAMETER);
    CHECK(set(sim, "gravity", down) == CUTIS_OK && cutis_sim_step(sim, 0.1) == CUTIS_OK);
    size_t gravity = cutis_port_find(sim, "gravity"), force = cutis_port_find(sim, "bone.reactionForce");
    double seed[3] = {1, NAN, 0}, out[6] = {0};
    CHECK(cutis_sim_directional_derivative(sim, &force, 1, &gravity, 1, seed, 3, out, 6) == CUTIS_ARGUMENT);
    seed[1] = 0;
    CHECK(cutis_sim_directional_derivative(sim, &force, 1, &gravity, 1, seed, 3, out, 6) == CUTIS_OK);
    CHECK(fabs(out[0] + out[3] - 0.06 * 0.04 * 0.02 * 1000) < 1e-9);
    /* A state that was restored is not dropped in silence. */
    CutisState *there = cutis_sim_save(sim);
    CHECK(cutis_sim_restore(fresh, there) == CUTIS_OK && cutis_sim_initialise(fresh) == CUTIS_ARGUMENT && says(fresh, "restored"));
    CHECK(cutis_sim_time(fresh) == 3.1 && cutis_sim_step(fresh, 0.1) == CUTIS_OK && cutis_sim_step(sim, 0.1) == CUTIS_OK);
    double one[6], other[6];
    CHECK(cutis_sim_get_f64(sim, force, one, 6) == CUTIS_OK && cutis_sim_get_f64(fresh, force, other, 6) == CUTIS_OK);
    CHECK(memcmp(one, other, sizeof one) == 0);
    CHECK(cutis_sim_reset(fresh) == CUTIS_OK && cutis_sim_set_time(fresh, 1.0) == CUTIS_OK && cutis_sim_initialise(fresh) == CUTIS_OK);
    cutis_state_free(there), cutis_sim_free(sim), cutis_sim_free(fresh);
}

static void starts_from_anywhere(void) {
    CutisSim *sim = scene("15e3", "");
    size_t n = 3 * cutis_node_count(sim);
    double *x = malloc(n * sizeof *x), *y = malloc(n * sizeof *y);
    CHECK(n > 0 && cutis_sim_initialise(sim) == CUTIS_OK && cutis_sim_nodes(sim, x, n) == CUTIS_OK);
    CHECK(cutis_sim_nodes(sim, y, n - 1) == CUTIS_ARGUMENT && cutis_sim_start_from(sim, x, n - 3) == CUTIS_ARGUMENT);
    for (size_t k = 0; k < n; ++k) y[k] = x[k] + 1e-3 * sin((double)k);
    CHECK(cutis_sim_start_from(sim, y, n) == CUTIS_OK && cutis_sim_initialise(sim) == CUTIS_ARGUMENT);
    CHECK(cutis_sim_step(sim, 0.1) == CUTIS_OK && cutis_sim_nodes(sim, y, n) == CUTIS_OK);
    double most = 0.0;
    for (size_t k = 0; k < n; ++k) most = fmax(most, fabs(x[k] - y[k]));
    CHECK(most < 1e-6);
    y[5] = INFINITY;
    CHECK(cutis_sim_start_from(sim, y, n) == CUTIS_ARGUMENT && says(sim, "finite") && cutis_sim_memory(sim) > 1000);
    free(x), free(y), cutis_sim_free(sim);
}

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *cancels(void *sim) {
    const struct timespec pause = {0, 200000000};
    nanosleep(&pause, NULL);
    CHECK(cutis_sim_cancel(sim) == CUTIS_OK);
    return NULL;
}

static void work_has_an_end(void) {
    CutisSim *sim = scene("15e3", "");
    size_t most = cutis_port_find(sim, "solver.mostSolves");
    int few = 3, none = 0, given = 0;
    const double d[6] = {0, 0, 0, 0.01, 0.01, 0}, back[6] = {0};
    CHECK(cutis_port_type(sim, most) == CUTIS_INT32 && cutis_port_causality(sim, most) == CUTIS_TUNABLE_PARAMETER);
    CHECK(cutis_sim_get_i32(sim, most, &given, 1) == CUTIS_OK && given == 1000);
    CHECK(cutis_sim_set_i32(sim, most, &none, 1) == CUTIS_ARGUMENT && cutis_sim_set_i32(sim, most, &few, 1) == CUTIS_OK);
    CHECK(cutis_sim_initialise(sim) == CUTIS_OK && set(sim, "bone.translation", d) == CUTIS_OK);
    CHECK(cutis_sim_step(sim, 0.1) == CUTIS_STEP && says(sim, "after 3 linear solves") && cutis_sim_time(sim) == 0.0);
    CHECK(cutis_sim_set_i32(sim, most, &given, 1) == CUTIS_OK && cutis_sim_step(sim, 0.1) == CUTIS_OK);
    CHECK(cutis_sim_cancel(sim) == CUTIS_OK && set(sim, "bone.translation", back) == CUTIS_OK);
    CHECK(cutis_sim_step(sim, 0.1) == CUTIS_OK); /* what was cancelled was no call */
    CHECK(cutis_sim_cancel(NULL) == CUTIS_NULL);
    cutis_sim_free(sim);

    /* A long run of steps that all have something to do. */
    CutisSim *slow = scene("15e3", "[inertia]\n");
    pthread_t thread;
    CHECK(cutis_sim_initialise(slow) == CUTIS_OK && set(slow, "bone.translation", d) == CUTIS_OK);
    double before = seconds();
    CHECK(pthread_create(&thread, NULL, cancels, slow) == 0);
    CHECK(cutis_sim_run_until(slow, 900.0, 0.001) == CUTIS_CANCELLED && says(slow, "cancelled"));
    CHECK(pthread_join(thread, NULL) == 0 && seconds() - before < 20.0 && cutis_sim_time(slow) < 900.0);
    CHECK(cutis_sim_step(slow, 0.001) == CUTIS_OK);
    cutis_sim_free(slow);
}

static void pipes(const char *beside) {
    char path[1000], text[2000], why[1000] = "";
    snprintf(path, sizeof path, "%.*s/pipe.vtu", (int)(strrchr(beside, '/') - beside), beside);
    unlink(path);
    CHECK(mkfifo(path, 0600) == 0);
    snprintf(text, sizeof text, "[mesh]\nfile = \"%s\"\n[[tissue]]\nE = 1e4\nnu = 0.4\n", path);
    CHECK(cutis_sim_new_from_text(text, NULL, why, sizeof why) == NULL && strstr(why, "pipe") != NULL);
    CHECK(cutis_sim_new_from_file(path, why, sizeof why) == NULL && strstr(why, "pipe") != NULL);
    unlink(path);
}

int main(int argc, char **argv) {
    states_of_other_scenes();
    calls_out_of_their_time();
    starts_from_anywhere();
    work_has_an_end();
    if (argc > 1) pipes(argv[1]);
    puts(failures == 0 ? "doors: all is well" : "doors: failed");
    return failures != 0;
}
