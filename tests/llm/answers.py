"""What scenarios are made of: their list by name, good answers and errors."""

ALL = {}

GOOD = '{"mutation_rate": 0.2}'


def scenario(play):
    """Enters a scenario under its function's name."""
    ALL[play.__name__] = play
    return play


def named(name, play):
    """Enters a scenario that a table makes."""
    ALL[name] = play


def completion(content=GOOD, finish="stop", message=None, usage=None, **fields):
    """A good answer's body, with fields changed."""
    if message is None:
        message = {"role": "assistant", "content": content}
    if usage is None:
        usage = {"prompt_tokens": 40, "completion_tokens": 8, "total_tokens": 48}
    body = {
        "id": "cmpl-1", "object": "chat.completion", "created": 1, "model": "played-1",
        "system_fingerprint": "fp-1",
        "choices": [{"index": 0, "finish_reason": finish, "message": message}], "usage": usage,
    }
    body.update(fields)
    return body


def good(connection, **changed):
    """A good answer, with the tokens that such a prompt may well have."""
    usage = {"prompt_tokens": len(connection.body) // 4, "completion_tokens": 8}
    connection.answer("200 OK", completion(usage=usage, **changed))


def error(message, **fields):
    """OpenAI's form of an error."""
    return {"error": {"message": message, **fields}}


named("good", lambda connection, number: good(connection))
named("varied", lambda connection, number: good(
    connection, content='{"mutation_rate": %.2f}' % (0.05 + number % 10 / 50)))
