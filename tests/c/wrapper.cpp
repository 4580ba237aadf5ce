// The C++17 wrapper: owners move, failures throw with their text, states return.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "cutis.hpp"

#undef NDEBUG
#include <cassert>

static const char *scene = "[mesh.block]\nsize = [0.06, 0.04, 0.02]\ncells = [3, 2, 1]\n[[tissue]]\nE = 15e3\nnu = 0.4\n"
                           "[[bone]]\nname = \"skull\"\nnodes = \"x_min\"\ndrive = \"held\"\n"
                           "[[bone]]\nname = \"jaw\"\nnodes = \"x_max\"\n";

int main() {
    cutis::Sim first = cutis::Sim::from_text(scene);
    cutis::Sim sim = std::move(first);
    sim.initialise();
    const std::size_t skin = sim.port("skin.position");
    assert(sim.shape(skin).size() == 2 && sim.shape(skin)[1] == 3 && sim.unit(skin) == "m");
    assert(sim.type(skin) == CUTIS_FLOAT64 && sim.causality(skin) == CUTIS_OUTPUT);
    assert(sim.ports().size() > 5 && !sim.description(skin).empty() && sim.token().size() == 38);
    assert(sim.get_int("skin.triangles").size() % 3 == 0);
    assert(std::isinf(sim.range(skin).first) && sim.range(skin).second > 1e300);

    const cutis::State rest = sim.save();
    sim.set("bone.translation", {0.0, 0.0, 0.0, 0.002, 0.0, 0.0});
    sim.step(0.1);
    const std::vector<double> moved = sim.get("skin.position");
    assert(sim.get_bool("solver.converged") && sim.warning().empty());
    const std::vector<std::uint8_t> bytes = sim.serialize(sim.save());

    sim.restore(rest);
    std::vector<double> back(sim.size(skin));
    sim.get(skin, cutis::View<double>(back));
    assert(back != moved && sim.time() == 0.0);
    sim.restore(sim.deserialize(bytes));
    assert(sim.get("skin.position") == moved && std::fabs(sim.time() - 0.1) < 1e-15);

    sim.run_until(0.25, 0.1);
    assert(std::fabs(sim.time() - 0.25) < 1e-15);
    sim.restore(sim.deserialize(bytes));

    const std::vector<std::size_t> out{skin, sim.port("bone.reactionForce")}, in{sim.port("bone.translation")};
    const std::vector<double> v{0, 0, 0, 1.0, -0.5, 0.25}, Jv = sim.directional_derivative(out, in, v);
    const std::vector<double> JTJv = sim.adjoint_derivative(out, in, Jv);
    double one = 0.0, other = 0.0;
    for (double x : Jv) one += x * x;
    for (std::size_t k = 0; k < v.size(); ++k) other += JTJv[k] * v[k];
    assert(one > 0.0 && std::fabs(one - other) < 1e-7 * one);

    // Loops as users write them: into vectors and arrays of their own, by index and by name, constant or not.
    std::vector<double> x(sim.size(skin)), y(sim.size(skin));
    const std::size_t triangles = sim.port("skin.triangles"), bone = sim.port("bone.translation");
    std::vector<std::int32_t> t(sim.size(triangles));
    std::array<double, 6> d{};
    const std::vector<double> there{0.0, 0.0, 0.0, 0.001, 0.0, 0.0};
    sim.get(triangles, t);
    sim.get("skin.triangles", t);
    for (int k = 0; k < 3; ++k) {
        d[3 * sim.row(bone, "jaw")] = 1e-4 * k;
        sim.set(bone, d);
        sim.set(bone, there);
        sim.set("bone.translation", there);
        sim.set("bone.translation", {0.0, 0.0, 0.0, 2e-4 * k, 0.0, 0.0});
        sim.step(0.1);
        sim.get(skin, x);
        sim.get("skin.position", y);
        assert(x == y && x == sim.get("skin.position"));
        double buffer[3 * 100];
        sim.get(skin, cutis::View<double>(buffer, sim.size(skin)));
    }
    assert((sim.rows(bone) == std::vector<std::string>{"skull", "jaw"}) && sim.rows(skin).empty());
    assert(sim.nodes().size() % 3 == 0 && sim.memory() > 1000);
    sim.start_from(sim.nodes());
    sim.set_int("solver.mostSolves", 500);
    sim.cancel();
    sim.step(0.1);
    sim.restore(sim.deserialize(bytes));

    int thrown = 0;
    auto refused = [&](CutisStatus status, const char *part, auto call) {
        try {
            call();
        } catch (const cutis::Error &error) {
            assert(error.status() == status && std::strstr(error.what(), part));
            ++thrown;
        }
    };
    refused(CUTIS_ARGUMENT, "no port", [&] { sim.get("no.such"); });
    refused(CUTIS_ARGUMENT, "", [&] { sim.set("bone.translation", {1.0}); });
    refused(CUTIS_ARGUMENT, "", [&] { sim.step(-1.0); });
    refused(CUTIS_ARGUMENT, "ahead", [&] { sim.run_until(-1.0, 0.1); });
    refused(CUTIS_ARGUMENT, "", [&] { cutis::Sim::from_baked(scene, {1, 2, 3}); });
    refused(CUTIS_ARGUMENT, "line 1", [&] { cutis::Sim::from_text("nonsense"); });
    refused(CUTIS_STATE, "", [&] { sim.deserialize(std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + 40)); });
    refused(CUTIS_ARGUMENT, "seed", [&] { sim.directional_derivative(out, in, {1.0}); });
    refused(CUTIS_ARGUMENT, "an input", [&] { sim.adjoint_derivative(out, out, Jv); });
    assert(thrown == 9);
    assert(sim.get("skin.position") == moved);
    std::puts("wrapper: all is well");
    return 0;
}
