// A flag that is searched for: lunr reads its dashes as "without" and refuses two of them. Message 2 is a query.
const post = Worker.prototype.postMessage
Worker.prototype.postMessage = function (message, ...more) {
  const asks = message && message.type === 2 && typeof message.data === "string"
  const data = asks ? message.data.replace(/(^|\s)--+(?=\S)/g, "$1") : null
  return post.call(this, asks ? { ...message, data } : message, ...more)
}
