"""The paper's tables, made with the project itself."""
