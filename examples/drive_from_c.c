/*  A strip of soft tissue between two bones, pulled through the C library.
 *
 *        fixed      10 cm      moved
 *       bone |================| bone --> 5 mm
 *            |________________|             cross-section 2 cm x 2 cm, E = 15 kPa
 *
 *  ./install --prefix ~/.local && export PKG_CONFIG_PATH=~/.local/lib/pkgconfig LD_LIBRARY_PATH=~/.local/lib
 *  cc -std=c99 examples/drive_from_c.c -o strip $(pkg-config --cflags --libs cutis) -lm && ./strip
 *
 *  Number to expect: about 0.31 N of pull; E A strain = 0.30 N, and a little more because the bones hold the ends wide.
 */
#include <math.h>
#include <stdio.h>

#include "cutis.h"

enum { STEPS = 10 };

static const char scene[] =
    "name = 'strip'\n"
    "[mesh.block]\n"
    "size = [0.1, 0.02, 0.02]\n"
    "cells = [20, 4, 4]\n"
    "[[tissue]]\n"
    "E = 15e3\n"
    "nu = 0.45\n"
    "[[bone]]\n"
    "name = 'fixed'\n"
    "nodes = 'x_min'\n"
    "[[bone]]\n"
    "name = 'moved'\n"
    "nodes = 'x_max'\n";

static int fail(const CutisSim *sim) {
    char message[512];
    cutis_sim_message(sim, message, sizeof message);
    fprintf(stderr, "%s\n", message);
    return 1;
}

int main(void) {
    char why[512];
    double translation[2][3] = {{0.0}}, reaction[2][3];
    size_t input, output;
    int k;
    CutisSim *sim = cutis_sim_new_from_text(scene, NULL, why, sizeof why);
    if (sim == NULL) {
        fprintf(stderr, "%s\n", why);
        return 1;
    }
    input = cutis_port_find(sim, "bone.translation");
    output = cutis_port_find(sim, "bone.reactionForce");
    if (cutis_sim_initialise(sim) != CUTIS_OK) return fail(sim);
    for (k = 1; k <= STEPS; ++k) {
        translation[1][0] = 5e-3 * k / STEPS;
        if (cutis_sim_set_f64(sim, input, &translation[0][0], 6) != CUTIS_OK) return fail(sim);
        if (cutis_sim_step(sim, 0.1) != CUTIS_OK) return fail(sim);
        if (cutis_sim_get_f64(sim, output, &reaction[0][0], 6) != CUTIS_OK) return fail(sim);
        printf("t = %.1f s  moved %.1f mm  pull %.4f N\n", cutis_sim_time(sim), 1e3 * translation[1][0], -reaction[1][0]);
    }
    cutis_sim_free(sim);
    return fabs(-reaction[1][0] - 0.31) < 0.015 ? 0 : 1;
}
