// What the parts of the Python module have in common.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/embed/bake.h"
#include "base/progress.h"
#include "base/result.h"

namespace lodestone::python {

namespace py = pybind11;

// An error as an exception of Python (lodestone.Error and those below it).
struct Failure {
    Error error;
};
// Ends a call that was given what it cannot take.
[[noreturn]] inline void refuse(const std::string& what) { throw Failure{{Fault::usage, what}}; }

// The value, or its error thrown.
template <class T>
T value_of(Result<T> result) {
    if (!result) throw Failure{result.error()};
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

// Runs work(progress) without the lock of the interpreter; Ctrl-C, and an exception of `report`, stop it and are
// thrown. report: None, or called with a stage and a fraction. Warnings become warnings of Python.
template <class Work>
auto run_long(const py::object& report, Work&& work) {
    std::atomic<bool> stop = false;
    std::unique_ptr<py::error_already_set> raised;
    const auto guarded = [&](auto&& call) {
        const py::gil_scoped_acquire lock;
        try {
            call();
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        } catch (py::error_already_set& e) {
            if (!raised) raised = std::make_unique<py::error_already_set>(e);
            stop = true;
        }
    };
    Progress progress;
    progress.stop = &stop;
    progress.report = [&](const std::string& stage, double fraction) {
        if (stop) return;
        guarded([&] {
            if (!report.is_none()) report(stage, fraction);
        });
    };
    progress.warn = [&](const std::string& line) {
        guarded([&] {
            if (PyErr_WarnEx(PyExc_UserWarning, line.c_str(), 1) != 0) throw py::error_already_set();
        });
    };
    auto result = [&] {
        const py::gil_scoped_release unlocked;
        return work(progress);
    }();
    if (raised) throw py::error_already_set(*raised);
    return value_of(std::move(result));
}

// A mesh that numpy arrays look into; it never changes.
struct Mesh {
    std::shared_ptr<const NamedMesh> named;
    std::vector<glm::vec3> room;  // of positions, where there are seams
    std::span<const glm::vec3> positions;
};
std::shared_ptr<Mesh> mesh_object(NamedMesh named);

// The words of a command line that keyword arguments stand for: resolution=65 is --resolution 65, fill_voids=True is
// --fill-voids, backends=["lod", "vgi"] is --backends lod,vgi.
std::vector<std::string> words_of(const py::kwargs& options);

// An array that looks into memory of `owner`, which it keeps alive; read-only.
template <class Element>
py::array view_of(const void* first, std::vector<py::ssize_t> shape, const py::object& owner) {
    py::array array(py::dtype::of<Element>(), std::move(shape), first, owner);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}
// An array that takes the values over, without a copy. per: numbers to an element.
template <class Number, class Values>
py::array taken_over(Values&& values, std::vector<py::ssize_t> shape) {
    using Kept = std::remove_reference_t<Values>;
    auto* kept = new Kept(std::forward<Values>(values));
    const py::capsule owner(kept, [](void* p) { delete static_cast<Kept*>(p); });
    return py::array(py::dtype::of<Number>(), std::move(shape), kept->data(), owner);
}

void bind_meshes(py::module_& module);
void bind_assets(py::module_& module);
void bind_atlases(py::module_& module);

}  // namespace lodestone::python
