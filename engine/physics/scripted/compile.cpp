// compile.cpp: reads the text of a scripted effect, by recursive descent, into a program. Nothing
// of the text reaches a compiler, a shell or a file.
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "physics/scripted/program.h"
#include "physics/scripted/tokens.h"
#include "physics/sensors.h"

namespace limax::scripted {

namespace {

constexpr int deepest = 100;  // nested brackets and signs, for the reader's own stack

// A number in the register of x, or a vector in all three.
struct value {
    bool vector = false;
    int16_t x = 0, y = 0, z = 0;
};

struct function {
    const char* name;
    operation what;
    int operands;
};
// Functions of numbers.
constexpr function functions[] = {
    {"sqrt", operation::root, 1},    {"sin", operation::sine, 1},
    {"cos", operation::cosine, 1},   {"exp", operation::exponential, 1},
    {"abs", operation::absolute, 1}, {"min", operation::smaller, 2},
    {"max", operation::larger, 2},   {"tanh", operation::tangent, 1},
    {"soft", operation::soft, 1},    {"clamp", operation::clamp, 3},
};

constexpr int operands_of(operation what) {
    switch (what) {
        case operation::negate:
        case operation::root:
        case operation::sine:
        case operation::cosine:
        case operation::exponential:
        case operation::absolute:
        case operation::inverted:
        case operation::tangent:
        case operation::soft: return 1;
        case operation::choose:
        case operation::clamp: return 3;
        default: return 2;
    }
}

// Arrays of a controller: genes, states, messages to the neighbours and from them.
struct built_in_array {
    const char* name;
    int size;
    bool writable;
};
constexpr built_in_array genes_array{"g", most_genes, false}, states_array{"s", most_states, true},
    said_array{"say", most_messages, true},
    heard_array{"heard", most_messages*sensors::neighbours, false};
constexpr built_in_array built_in_arrays[] = {genes_array, states_array, said_array, heard_array};

// The results of a text, by the name of the one that it must set: the force f, or the activation a.
enum class kind { force, controller };

class reader : private token_reader {
public:
    reader(kind of, const std::string& place, const std::string& text,
           const std::vector<parameter>& parameters);
    program read();

private:
    bool controls() const { return kind_ == kind::controller; }
    const char* result() const { return controls() ? "a" : "f"; }
    void require_register() const {
        const int most = controls() ? most_registers_of_controller : most_registers;
        if (program_.constants.size() + steps_.size() >= std::size_t(most))
            refuse_read(format("this law takes more than %d numbers and operations", most));
    }
    int16_t constant(double number);
    int16_t emit(operation what, int16_t a, int16_t b = 0, int16_t c = 0);
    value number(operation what, value a, value b = {}, value c = {}) {
        return {false, emit(what, a.x, b.x, c.x), 0, 0};
    }
    // An operation on each component; a number stands for three.
    value each(operation what, value a, value b) {
        if (!a.vector) a.y = a.z = a.x;
        if (!b.vector) b.y = b.z = b.x;
        return {true, emit(what, a.x, b.x), emit(what, a.y, b.y), emit(what, a.z, b.z)};
    }
    value need_number(value v, const std::string& of) {
        if (v.vector) refuse_read(of + " takes numbers, not vectors");
        return v;
    }
    value need_vector(value v, const std::string& of) {
        if (!v.vector) refuse_read(of + " takes vectors, not numbers");
        return v;
    }

    void statement();
    void declare_array(const std::string& name);
    const built_in_array* writable_array(const std::string& name) const;
    void set_element(const built_in_array& array);
    void set_output(const std::string& output, bool replaces);
    int index_below(int end, const std::string& of);
    value element(const std::string& name);
    std::vector<int16_t> layer_of(int outputs);
    void add_inputs_of_controller();
    void check_arrays();
    void add_inputs(value v, std::vector<int16_t>& to);
    value expression() { return choice(); }
    value choice();
    value disjunction();
    value conjunction();
    value comparison();
    value sum();
    value product();
    value signed_value();
    value component_of(value v);
    int16_t& component_here(value& v);
    value primary();
    value call(const std::string& name);
    value dot(value a, value b);

    const kind kind_;
    int depth_ = 0;
    program program_;
    // numbered as by constant()
    std::vector<instruction> steps_;
    std::map<std::string, value> names_;
    std::map<std::string, std::vector<int16_t>> arrays_;  // of numbers, by their registers
    std::set<std::string> fixed_;                         // names that no statement may change
    std::set<std::string> own_words_;
    // of the states and messages of a controller, by index: whether the text sets and reads them
    bool set_[2][most_states] = {}, read_[2][most_states] = {};
    bool sets_result_ = false;
    std::set<std::string> unread_;  // outputs, such as f or s[0], set and not read since
};

// While reading, constants are numbered below 0 and results from the last input on.
int16_t reader::constant(double number) {
    require_register();
    program_.constants.push_back(number);
    return int16_t(-int(program_.constants.size()));
}

int16_t reader::emit(operation what, int16_t a, int16_t b, int16_t c) {
    require_register();
    steps_.push_back({what, a, b, c});
    return int16_t(program_.inputs + int(steps_.size()) - 1);
}

void reader::add_inputs_of_controller() {
    int16_t at = 0;
    for (const sensors::sensor& each : sensors::list) {
        names_[each.name] = {each.components == 3, at, int16_t(at + 1), int16_t(at + 2)};
        at = int16_t(at + each.components);
    }
    for (const auto& [array, first] : {std::pair{states_array, sensors::first_state},
                                       std::pair{heard_array, sensors::first_heard}}) {
        std::vector<int16_t>& held = arrays_[array.name];
        for (int i = 0; i < array.size; ++i) held.push_back(int16_t(first + i));
    }
    for (const built_in_array& each : built_in_arrays) own_words_.insert(each.name);
    own_words_.insert("perceptron");
}

reader::reader(kind of, const std::string& place, const std::string& text,
               const std::vector<parameter>& parameters)
    : token_reader(place, text), kind_(of) {
    program_.inputs = controls() ? sensors::inputs : force_inputs;
    own_words_ = {"real", result(), "vec", "dot", "cross", "length"};
    for (const function& each : functions) own_words_.insert(each.name);
    const int16_t zero = constant(0);
    if (controls()) {
        add_inputs_of_controller();
        arrays_[said_array.name].assign(most_messages, zero);
    } else {
        names_ = {{"x", {true, input_position, input_position + 1, input_position + 2}},
                  {"v", {true, input_velocity, input_velocity + 1, input_velocity + 2}},
                  {"m", {false, input_mass}},
                  {"t", {false, input_time}}};
    }
    const auto refuse_input = [&](const std::string& problem) {
        fail(LIMAX_INVALID_ARGUMENT, place + ": " + problem);
    };
    for (const parameter& input : parameters) {
        const char* const name = input.name.c_str();
        if (!is_name(input.name))
            refuse_input(format("a parameter's name is letters, digits and _, not '%.60s'", name));
        if (names_.count(input.name) || own_words_.count(input.name))
            refuse_input(format("no parameter can be called '%s': the name is taken", name));
        if (input.components != 1 && input.components != 3)
            refuse_input(format("parameter '%s' has %d components; it must be 1 or 3", name,
                                input.components));
        value held{input.components == 3};
        int16_t* const components[3] = {&held.x, &held.y, &held.z};
        for (int c = 0; c < input.components; ++c) {
            if (!std::isfinite(input.value[c]))
                refuse_input(format("parameter '%s' is not finite", name));
            *components[c] = constant(input.value[c]);
            ++program_.parameters;
        }
        names_[input.name] = held;
    }
    for (const auto& [name, _] : names_) fixed_.insert(name);
    names_[result()] = {!controls(), zero, zero, zero};
    advance();
}

program reader::read() {
    while (now_.kind != token::end) {
        const bool sets = now_.kind == token::word && now_.text == result();
        statement();
        sets_result_ = sets_result_ || sets;
    }
    if (!sets_result_)
        refuse(
            format("the text never sets the %s %s", controls() ? "activation" : "force", result()));
    const auto place_of = [&](int at) -> int16_t {
        if (at < 0) return int16_t(program_.inputs - 1 - at);
        return int16_t(at < program_.inputs ? at : at + int(program_.constants.size()));
    };
    check_arrays();
    // inputs that are read
    const auto used = [&](int at) {
        if (at >= 0 && at < program_.inputs) {
            if (at < sensors::count)
                program_.sensors |= uint64_t(1) << at;
            else if (at < sensors::first_heard)
                program_.states = std::max(program_.states, at - sensors::first_state + 1);
            else
                program_.messages = std::max(program_.messages,
                                             (at - sensors::first_heard) / sensors::neighbours + 1);
        }
        return place_of(at);
    };
    for (const instruction& step : steps_)
        program_.instructions.push_back(
            step.what >= operation::gene
                ? step
                : instruction{step.what, used(step.a),
                              operands_of(step.what) > 1 ? used(step.b) : place_of(step.b),
                              operands_of(step.what) > 2 ? used(step.c) : place_of(step.c)});
    for (layer& each : program_.layers)
        for (int16_t& input : each.inputs) input = used(input);
    const value set = names_[result()];
    program_.results = {used(set.x)};
    if (!controls()) {
        program_.results.push_back(place_of(set.y));
        program_.results.push_back(place_of(set.z));
        return std::move(program_);
    }
    const auto add_results = [&](const built_in_array& array, int count) {
        for (int i = 0; i < count; ++i) program_.results.push_back(used(arrays_[array.name][i]));
    };
    add_results(states_array, program_.states);
    add_results(said_array, program_.messages);
    return std::move(program_);
}

// [vec|real] NAME [.x|.y|.z] (=|+=) expression ;
void reader::statement() {
    if (take(";")) return;
    if (now_.kind != token::word)
        refuse(format("expected a statement such as 'f = ...;', got %s", here().c_str()));
    std::string name = now_.text;
    advance();
    const bool makes = name == "vec" || name == "real";
    const bool as_vector = name == "vec";
    if (makes) {
        if (now_.kind != token::word) refuse(format("expected a name, got %s", here().c_str()));
        name = now_.text;
        if (names_.count(name) || own_words_.count(name) || arrays_.count(name))
            refuse(format("the name '%s' is taken", name.c_str()));
        advance();
        if (controls() && !as_vector && take("[")) return declare_array(name);
    } else if (const built_in_array* array = writable_array(name)) {
        return set_element(*array);
    } else if (controls() && name == genes_array.name) {
        refuse_read("genes are inputs and cannot be changed");
    } else if (name == "if" || name == "for" || name == "while") {
        refuse_read(format("there is no '%s'; a choice is  condition ? b : c", name.c_str()));
    } else if (!names_.count(name)) {
        refuse_read(
            format("unknown name '%s'; a new one begins with 'real' or 'vec'", name.c_str()));
    } else if (fixed_.count(name)) {
        refuse_read(format("'%s' is an input and cannot be changed", name.c_str()));
    }
    value& target = names_[name];
    int16_t* component = nullptr;
    if (!makes && target.vector && take(".")) component = &component_here(target);
    const bool adds = !makes && at("+=");
    if (!adds && !at("="))
        refuse_read(format("expected '=' after '%s', got %s", name.c_str(), here().c_str()));
    // a name is not yet known within the statement that makes it
    value before = target;
    if (makes) names_.erase(name);
    advance();
    value result = expression();
    const bool wants_vector = makes ? as_vector : before.vector && !component;
    if (result.vector != wants_vector)
        refuse_read(format("'%s' is a %s; this is a %s", name.c_str(),
                           wants_vector ? "vector" : "number",
                           result.vector ? "vector" : "number"));
    if (name == this->result()) set_output(name, !adds && !component);
    if (component) {
        *component = adds ? emit(operation::add, *component, result.x) : result.x;
    } else {
        if (adds)
            result = before.vector ? each(operation::add, before, result)
                                   : number(operation::add, before, result);
        names_[name] = result;
    }
    if (now_.kind != token::end) need(";");
}

// Refuses to replace the value of an output that nothing has read.
void reader::set_output(const std::string& output, bool replaces) {
    if (!unread_.insert(output).second && replaces)
        refuse_read(
            format("'%s' is set again before its value is read; '+=' adds to it", output.c_str()));
}

const built_in_array* reader::writable_array(const std::string& name) const {
    if (!controls()) return nullptr;
    for (const built_in_array& each : built_in_arrays)
        if (each.writable && name == each.name) return &each;
    return nullptr;
}

// The rest of  real NAME[N] = perceptron(...);
void reader::declare_array(const std::string& name) {
    if (now_.kind != token::number) refuse("the size of an array is a number");
    const int size = index_below(most_hidden + 1, "the size of an array");
    need("]");
    need("=");
    if (now_.kind != token::word || now_.text != "perceptron")
        refuse("an array is what a perceptron gives: real y[2] = perceptron(...);");
    if (size < 1) refuse("an array has at least one element");
    advance();
    std::vector<int16_t> outputs = layer_of(size);
    arrays_[name] = std::move(outputs);
    if (now_.kind != token::end) need(";");
}

// The rest of  NAME[i] (=|+=) expression;
void reader::set_element(const built_in_array& array) {
    need("[");
    const int index = index_below(array.size, format("an index of %s", array.name));
    need("]");
    set_[array.name != states_array.name][index] = true;
    int& count = array.name == states_array.name ? program_.states : program_.messages;
    count = std::max(count, index + 1);
    const bool adds = at("+=");
    if (!adds && !at("=")) refuse(format("expected '=', got %s", here().c_str()));
    advance();
    const value result = need_number(expression(), array.name);
    set_output(format("%s[%d]", array.name, index), !adds);
    int16_t& element = arrays_[array.name][std::size_t(index)];
    element = adds ? emit(operation::add, element, result.x) : result.x;
    if (now_.kind != token::end) need(";");
}

// A whole number from 0 on, written out.
int reader::index_below(int end, const std::string& of) {
    const double number = now_.number_value;
    if (now_.kind != token::number || number != std::floor(number) || number >= end)
        refuse(format("%s is a whole number from 0 to %d, not %s", of.c_str(), end - 1,
                      here().c_str()));
    advance();
    return int(number);
}

// NAME[i], after the name.
value reader::element(const std::string& name) {
    need("[");
    value result;
    if (name == genes_array.name) {
        const int index = index_below(most_genes, "an index of g");
        program_.genes = std::max(program_.genes, index + 1);
        result.x = emit(operation::gene, int16_t(index));
    } else {
        const std::vector<int16_t>& held = arrays_.at(name);
        const int index = index_below(int(held.size()), "an index of " + name);
        if (name == states_array.name) read_[0][index] = true;
        if (name == heard_array.name) read_[1][index / sensors::neighbours] = true;
        unread_.erase(format("%s[%d]", name.c_str(), index));
        result.x = held[std::size_t(index)];
    }
    need("]");
    return result;
}

// Refuses states and messages that are read and never set, and genes of two perceptrons.
void reader::check_arrays() {
    for (int i = 0; i < most_states; ++i) {
        if (read_[0][i] && !set_[0][i])
            refuse(format("s[%d] is read and never set, so it is always 0", i));
        if (read_[1][i] && !set_[1][i])
            refuse(format("heard[%d] to heard[%d] are message %d, and the text never sets say[%d]",
                          i * sensors::neighbours, (i + 1) * sensors::neighbours - 1, i, i));
    }
    const auto end_of = [](const layer& each) {
        return each.first + genes_of_layer(int(each.inputs.size()), each.hidden, each.outputs);
    };
    for (const layer& a : program_.layers)
        for (const layer& b : program_.layers)
            if (&a < &b && a.first < end_of(b) && b.first < end_of(a))
                refuse(
                    format("two perceptrons have genes in common: those from g[%d] end before "
                           "g[%d], those from g[%d] before g[%d]",
                           a.first, end_of(a), b.first, end_of(b)));
}

void reader::add_inputs(value v, std::vector<int16_t>& to) {
    to.push_back(v.x);
    if (v.vector) to.insert(to.end(), {v.y, v.z});
}

// The rest of  perceptron(hidden, g[first], input, ...): the registers of its outputs.
std::vector<int16_t> reader::layer_of(int outputs) {
    need("(");
    layer made{0, index_below(most_hidden + 1, "the number of hidden units"), {}, outputs};
    if (made.hidden < 1) refuse_read("a perceptron has at least one hidden unit");
    need(",");
    if (now_.kind != token::word || now_.text != genes_array.name)
        refuse("the second value of a perceptron is its first gene, such as g[0]");
    advance();
    need("[");
    made.first = index_below(most_genes, "an index of g");
    need("]");
    if (made.first % layer_alignment != 0)
        refuse_read(format("the first gene of a perceptron is a multiple of %d, not %d",
                           layer_alignment, made.first));
    while (take(",")) {
        const auto array = now_.kind == token::word ? arrays_.find(now_.text) : arrays_.end();
        if (array == arrays_.end() || before('[')) {
            add_inputs(expression(), made.inputs);
        } else {
            made.inputs.insert(made.inputs.end(), array->second.begin(), array->second.end());
            for (std::size_t i = 0; i < array->second.size(); ++i)
                unread_.erase(format("%s[%zu]", array->first.c_str(), i));
            advance();
        }
    }
    need(")");
    const int inputs = int(made.inputs.size());
    if (inputs < 1 || inputs > most_hidden)
        refuse_read(format("a perceptron has 1 to %d inputs, not %d", most_hidden, inputs));
    if (program_.layers.size() == std::size_t(most_layers))
        refuse_read(format("at most %d perceptrons are possible", most_layers));
    const int end = made.first + genes_of_layer(inputs, made.hidden, outputs);
    if (end > most_genes)
        refuse_read(format("this perceptron's genes end at g[%d]; there are at most %d genes",
                           end - 1, most_genes));
    program_.genes = std::max(program_.genes, end);
    const auto number = int16_t(program_.layers.size());
    program_.layers.push_back(std::move(made));
    std::vector<int16_t> at{emit(operation::layer, number)};
    for (int i = 1; i < outputs; ++i) at.push_back(emit(operation::of_layer, number));
    return at;
}

value reader::choice() {
    if (++depth_ > deepest) refuse(format("more than %d levels of brackets", deepest));
    value chosen = disjunction();
    if (take("?")) {
        const value condition = need_number(chosen, "?");
        const value yes = choice();
        need(":");
        const value no = choice();
        if (yes.vector != no.vector)
            refuse_read("both sides of ':' must be numbers, or both vectors");
        chosen = number(operation::choose, condition, yes, no);
        if (yes.vector)
            chosen = {true, chosen.x, emit(operation::choose, condition.x, yes.y, no.y),
                      emit(operation::choose, condition.x, yes.z, no.z)};
    }
    --depth_;
    return chosen;
}

value reader::disjunction() {
    value left = conjunction();
    while (take("||"))
        left = number(operation::either, need_number(left, "||"), need_number(conjunction(), "||"));
    return left;
}

value reader::conjunction() {
    value left = comparison();
    while (take("&&"))
        left = number(operation::both, need_number(left, "&&"), need_number(comparison(), "&&"));
    return left;
}

value reader::comparison() {
    const value left = sum();
    const std::string sign = now_.text;
    static const std::set<std::string> comparisons = {"<", ">", "<=", ">=", "==", "!="};
    if (!comparisons.count(sign)) return left;
    advance();
    const value right = need_number(sum(), sign);
    need_number(left, sign);
    if (sign == "<") return number(operation::less, left, right);
    if (sign == ">") return number(operation::less, right, left);
    if (sign == "<=") return number(operation::at_most, left, right);
    if (sign == ">=") return number(operation::at_most, right, left);
    const value same = number(operation::equal, left, right);
    return sign == "==" ? same : number(operation::inverted, same);
}

value reader::sum() {
    value left = product();
    while (at("+") || at("-")) {
        const operation what = at("+") ? operation::add : operation::subtract;
        advance();
        const value right = product();
        if (left.vector != right.vector)
            refuse_read("a number and a vector cannot be added or subtracted");
        left = left.vector ? each(what, left, right) : number(what, left, right);
    }
    return left;
}

value reader::product() {
    value left = signed_value();
    while (at("*") || at("/")) {
        const bool divides = at("/");
        advance();
        const value right = signed_value();
        if (divides && right.vector) refuse_read("nothing can be divided by a vector");
        if (left.vector && right.vector)
            refuse_read("two vectors cannot be multiplied by *; there are dot and cross");
        const operation what = divides ? operation::divide : operation::multiply;
        left = left.vector || right.vector ? each(what, left, right) : number(what, left, right);
    }
    return left;
}

value reader::signed_value() {
    if (++depth_ > deepest) refuse(format("more than %d levels of brackets", deepest));
    value result;
    if (take("-")) {
        result = signed_value();
        result = result.vector
                     ? value{true, emit(operation::negate, result.x),
                             emit(operation::negate, result.y), emit(operation::negate, result.z)}
                     : number(operation::negate, result);
    } else if (take("!")) {
        result = number(operation::inverted, need_number(signed_value(), "!"));
    } else {
        result = component_of(primary());
    }
    --depth_;
    return result;
}

value reader::component_of(value v) {
    if (!take(".")) return v;
    if (!v.vector) refuse_read("a number has no components");
    return {false, component_here(v), 0, 0};
}

int16_t& reader::component_here(value& v) {
    int16_t* const component = now_.text == "x"   ? &v.x
                               : now_.text == "y" ? &v.y
                               : now_.text == "z" ? &v.z
                                                  : nullptr;
    if (!component) refuse(format("a vector has x, y and z, not %s", here().c_str()));
    advance();
    return *component;
}

value reader::primary() {
    if (now_.kind == token::number) {
        const value result{false, constant(now_.number_value), 0, 0};
        advance();
        return result;
    }
    if (take("(")) {
        const value inside = expression();
        need(")");
        return inside;
    }
    if (now_.kind != token::word)
        refuse(format("expected a number, a name or '(', got %s", here().c_str()));
    const std::string name = now_.text;
    const auto found = names_.find(name);
    if (found != names_.end()) {
        if (name == result() && !sets_result_)
            refuse(format("'%s' is read before it is set", name.c_str()));
        unread_.erase(name);
        advance();
        return found->second;
    }
    if (arrays_.count(name) || (controls() && name == genes_array.name)) {
        advance();
        return element(name);
    }
    if (own_words_.count(name) && name != "real") {
        advance();
        return call(name);
    }
    std::string there, callable;
    for (const auto& [word, _] : names_) there += (there.empty() ? "" : ", ") + word;
    for (const std::string& word : own_words_)
        if (word != "real" && word != result()) callable += (callable.empty() ? "" : ", ") + word;
    refuse(format("unknown name '%s'; there are %s, and the functions %s", name.c_str(),
                  there.c_str(), callable.c_str()));
}

value reader::call(const std::string& name) {
    if (controls() && name == "perceptron")
        refuse_read("a perceptron gives an array: real y[2] = perceptron(...);");
    for (const built_in_array& each : built_in_arrays)
        if (controls() && name == each.name)
            refuse_read(format("'%s' is an array: %s[0]", each.name, each.name));
    need("(");
    std::vector<value> arguments;
    do arguments.push_back(expression());
    while (take(","));
    need(")");
    const auto takes = [&](std::size_t count) {
        if (arguments.size() != count)
            refuse_read(format("%s takes %zu %s, not %zu", name.c_str(), count,
                               count == 1 ? "value" : "values", arguments.size()));
    };
    for (const function& candidate : functions) {
        if (name != candidate.name) continue;
        takes(std::size_t(candidate.operands));
        for (const value v : arguments) need_number(v, name);
        arguments.resize(3);
        return number(candidate.what, arguments[0], arguments[1], arguments[2]);
    }
    takes(name == "vec" ? 3 : name == "length" ? 1 : 2);
    if (name == "vec") {
        for (const value v : arguments) need_number(v, name);
        return {true, arguments[0].x, arguments[1].x, arguments[2].x};
    }
    for (const value v : arguments) need_vector(v, name);
    if (name == "length") return number(operation::root, dot(arguments[0], arguments[0]));
    if (name == "dot") return dot(arguments[0], arguments[1]);
    const value a = arguments[0], b = arguments[1];
    const auto minor = [&](int16_t p, int16_t q, int16_t r, int16_t s) {
        return emit(operation::subtract, emit(operation::multiply, p, q),
                    emit(operation::multiply, r, s));
    };
    return {true, minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x)};
}

value reader::dot(value a, value b) {
    const int16_t first = emit(operation::add, emit(operation::multiply, a.x, b.x),
                               emit(operation::multiply, a.y, b.y));
    return {false, emit(operation::add, first, emit(operation::multiply, a.z, b.z)), 0, 0};
}

}  // namespace

program compile(const std::string& place, const std::string& text,
                const std::vector<parameter>& parameters) {
    return reader(kind::force, place, text, parameters).read();
}
program compile_controller(const std::string& place, const std::string& text,
                           const std::vector<parameter>& parameters) {
    return reader(kind::controller, place, text, parameters).read();
}

}  // namespace limax::scripted
